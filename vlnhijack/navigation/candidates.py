"""Where an agent may go from a viewpoint, as HAMT's `make_candidate` reads it from MatterSim."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vlnhijack.navigation.graph import NavigationGraph
from vlnhijack.navigation.views import COLUMNS, ROWS, VIEWS, view_angles

HALF_HORIZONTAL_FOV = np.radians(60.0) * 640 / 480 / 2  # MatterSim: linear in the aspect


@dataclass(frozen=True)
class Candidate:
    """A neighbour and the view that looks at it most directly.

    heading (not wrapped) and elevation of the neighbour in the world's frame, radians; distance:
    angle between it and the view's axis, radians; idx: its place, from 1, among the neighbours that
    this view shows, nearest to the axis first (MatterSim's navigableLocations).
    """

    viewpoint: str
    point_id: int
    heading: float
    elevation: float
    distance: float
    idx: int


def candidates(graph: NavigationGraph) -> dict[str, list[Candidate]]:
    """The candidates of every viewpoint, in HAMT's list order.

    The order is that of first sight in a sweep over the 36 views, nearest to the axis first; a
    neighbour right above or below is never seen. Matches MatterSim to the bit: poses, vectors and
    relative headings are float32, relative elevations float64.
    """
    return {name: _candidates_of(graph, row) for row, name in enumerate(graph.viewpoints)}


def _candidates_of(graph: NavigationGraph, row: int) -> list[Candidate]:
    neighbours = np.flatnonzero(graph.adjacency[row])
    neighbours = neighbours[neighbours != row]
    positions = graph.positions.astype(np.float32)
    visible, heading, elevation = _relative_angles(positions[neighbours] - positions[row])
    distance = np.where(visible, np.sqrt(heading**2 + elevation**2), np.inf)
    first = visible.argmax(axis=0)
    best = distance.argmin(axis=0) if len(neighbours) else first
    order = np.lexsort((distance[first, np.arange(len(neighbours))], first))
    return [
        Candidate(
            graph.viewpoints[neighbours[k]],
            int(best[k]),
            float(view_angles(int(best[k]))[0] + heading[best[k], k]),
            float(view_angles(int(best[k]))[1] + elevation[best[k], k]),
            float(distance[best[k], k]),
            1 + int((distance[best[k]] < distance[best[k], k]).sum()),
        )
        for k in order
        if visible[:, k].any()
    ]


def _relative_angles(
    offsets: NDArray[np.float32],
) -> tuple[NDArray[np.bool_], NDArray[np.float64], NDArray[np.float64]]:
    """Visibility, relative heading and relative elevation (36,N) of offsets (N,3)."""
    angles = np.array([view_angles(view) for view in range(VIEWS)])
    adjusted = np.pi / 2 - angles[:COLUMNS, :1]
    cx, cy = np.cos(adjusted).astype(np.float32), np.sin(adjusted).astype(np.float32)
    x, y, z = offsets.T
    length = np.sqrt(x * x + y * y)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = np.float32(1) / length
        cosine = (x * inverse) * cx + (y * inverse) * cy
        heading = _atan2(x * cy - y * cx, x * cx + y * cy)
        elevation = _atan2(z.astype(np.float64), length.astype(np.float64)) - angles[:, 1:]
    seen = cosine >= np.cos(HALF_HORIZONTAL_FOV)
    return np.tile(seen, (ROWS, 1)), np.tile(heading, (ROWS, 1)), elevation


def _atan2(y: NDArray[np.floating], x: NDArray[np.floating]) -> NDArray[np.float64]:
    """The C library's atan2 in the precision of its arguments, through its clog.

    numpy's own vectorised arctan2 differs from it by 1 ulp on some machines.
    """
    phases: NDArray[np.float64] = np.log(x + np.array(1j, np.result_type(y, np.complex64)) * y).imag
    return phases.astype(np.float64)
