"""The 36 views of a panorama: index = 12·row + column, as in Matterport3DSimulator.

Row 0 looks 30° down, row 1 at the horizon, row 2 30° up; column k looks along heading k·30°.
"""

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vlnhijack.errors import InputError
from vlnhijack.frames import Camera

COLUMNS = 12
ROWS = 3
VIEWS = COLUMNS * ROWS
STEP = 2 * np.pi / COLUMNS
_RANGE = re.compile(r" *([0-9]{1,2}) *(?:- *([0-9]{1,2}) *)?")


@dataclass(frozen=True, order=True)
class View:
    """One of the 36 views of a viewpoint."""

    viewpoint: str
    index: int


def view_angles(index: int) -> tuple[float, float]:
    """Heading in [0, 2π) and elevation of a view, radians; InputError outside 0…35."""
    if not 0 <= index < VIEWS:
        raise InputError(field="view", expected=f"an index in [0, {VIEWS})", received=index)
    row, column = divmod(index, COLUMNS)
    return column * STEP, (row - 1) * STEP


def parse_views(text: str) -> list[int]:
    """Indices of views, ascending, from a list such as "3,5,12-14"; InputError for other text."""
    found: set[int] = set()
    for part in text.split(","):
        match = _RANGE.fullmatch(part)
        first, last = (int(match[1]), int(match[2] or match[1])) if match else (VIEWS, VIEWS)
        if not first <= last < VIEWS:
            raise InputError(
                field="views",
                expected=f"indices in [0, {VIEWS}), such as 0-35 or 3,5,12-14",
                received=text,
            )
        found.update(range(first, last + 1))
    return sorted(found)


def nearest_view(heading: float) -> int:
    """The view at the horizon whose heading is nearest, as the simulator snaps headings."""
    return COLUMNS + int(np.floor((heading % (2 * np.pi)) / STEP + 0.5)) % COLUMNS


def panorama_cameras(position: tuple[float, float, float], width: int, height: int) -> list[Camera]:
    """The 36 cameras of a viewpoint at `position` (metres), images of width × height pixels."""
    angles = (view_angles(index) for index in range(VIEWS))
    return [Camera(position, heading, elevation, width, height) for heading, elevation in angles]


def angle_features(base_view: int) -> NDArray[np.float32]:
    """(36,4) sin h, cos h, sin e, cos e with headings relative to the base view's.

    Matches HAMT's `get_point_angle_feature`: the base view's elevation is not subtracted.
    """
    base, _ = view_angles(base_view)
    angles = np.array([view_angles(index) for index in range(VIEWS)])
    return angle_feature(angles[:, 0] - base, angles[:, 1])


def angle_feature(
    heading: NDArray[np.float64] | float, elevation: NDArray[np.float64] | float
) -> NDArray[np.float32]:
    """(...,4) float32 sin h, cos h, sin e, cos e of angles (...) in radians."""
    parts = (np.sin(heading), np.cos(heading), np.sin(elevation), np.cos(elevation))
    return np.stack(parts, axis=-1).astype(np.float32)
