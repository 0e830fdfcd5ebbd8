"""The shell of a house: floors, ceilings, walls with thickness, trims, windows.

Everything is an axis-aligned rectangle, a `Panel`, that faces into the rooms; the panels of one
room share one atlas of rectangles with texels of about 2.5 cm.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np
from numpy.typing import NDArray

from vlnhijack.scenes.house import Room
from vlnhijack.scenes.procedural.floor_plan import WALL_THICKNESS, Doorway, FloorPlan, Window

TEXEL = 0.025
PADDING = 2

Point = tuple[float, float, float]
Box = tuple[Point, Point]


@dataclass(frozen=True)
class Panel:
    """A rectangle from `low` to `high`, flat along `axis` and facing `sign` of it, with holes."""

    axis: int
    sign: int
    low: Point
    high: Point
    material: str
    holes: tuple[Box, ...] = ()

    @property
    def edges(self) -> tuple[int, int]:
        """The axes of u and v, so that u × v is the normal."""
        first, second = (self.axis + 1) % 3, (self.axis + 2) % 3
        return (first, second) if self.sign > 0 else (second, first)

    def length(self, axis: int) -> float:
        return self.high[axis] - self.low[axis]


@dataclass(frozen=True)
class Shell:
    """The mesh of one room's shell; `face_material` (F,) indexes `materials`."""

    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]
    uv: NDArray[np.float32]
    face_material: NDArray[np.int32]
    materials: tuple[str, ...]
    height: int
    width: int


def room_shell(plan: FloorPlan, room: int) -> Shell:
    """The shell of one room; each doorway's reveal belongs to the first of its two rooms."""
    return shell(list(_panels(plan, room)))


def shell(panels: Sequence[Panel]) -> Shell:
    """Panels as one mesh with packed, padded, non-overlapping charts."""
    corners, height, width = _pack([_chart_size(panel) for panel in panels])
    materials = tuple(sorted({panel.material for panel in panels}))
    vertices, uv, owner = [], [], []
    for panel, corner in zip(panels, corners, strict=True):
        points, pixels = _quads(panel, corner)
        vertices.append(points)
        uv.append(pixels / (width, height))
        owner += [materials.index(panel.material)] * (len(points) // 4 * 2)
    first = 4 * np.arange(len(owner) // 2)[:, None]
    faces = np.concatenate([first + (0, 1, 2), first + (0, 2, 3)], axis=1).reshape(-1, 3)
    return Shell(
        np.concatenate(vertices).astype(np.float32),
        faces.astype(np.int32),
        np.concatenate(uv).astype(np.float32),
        np.array(owner, np.int32),
        materials,
        height,
        width,
    )


def _quads(panel: Panel, corner: tuple[int, int]) -> tuple[NDArray, NDArray]:
    """Corners (4Q,3) in metres and (4Q,2) in pixels of the quads that are left by the holes."""
    u, v = panel.edges
    cuts = {axis: {panel.low[axis], panel.high[axis]} for axis in (u, v)}
    for (low, high), axis in product(panel.holes, (u, v)):
        cuts[axis] |= {min(max(x[axis], panel.low[axis]), panel.high[axis]) for x in (low, high)}
    size = dict(zip((u, v), _chart_size(panel), strict=True))
    points, pixels = [], []
    for (u0, u1), (v0, v1) in product(pairwise(sorted(cuts[u])), pairwise(sorted(cuts[v]))):
        middle = {u: (u0 + u1) / 2, v: (v0 + v1) / 2}
        if any(all(a[x] < middle[x] < b[x] for x in (u, v)) for a, b in panel.holes):
            continue
        for at in ((u0, v0), (u1, v0), (u1, v1), (u0, v1)):
            point = np.array(panel.low)
            point[[u, v]] = at
            points.append(point)
            pixels.append(
                [
                    corner[k] + (at[k] - panel.low[x]) / panel.length(x) * size[x]
                    for k, x in enumerate((u, v))
                ]
            )
    return np.array(points), np.array(pixels)


def _chart_size(panel: Panel) -> tuple[int, int]:
    """Width and height of the panel's chart in texels."""
    u, v = (max(2, int(np.ceil(panel.length(axis) / TEXEL))) for axis in panel.edges)
    return u, v


def _pack(sizes: Sequence[tuple[int, int]]) -> tuple[list[tuple[int, int]], int, int]:
    """Shelf packing: the first texel (column, row) of every chart, and the atlas' height, width."""
    gap = 2 * PADDING
    area = sum((w + gap) * (h + gap) for w, h in sizes)
    width = max(int(np.sqrt(area)) + 1, max(w for w, _ in sizes) + gap)
    corners: list[tuple[int, int]] = [(0, 0)] * len(sizes)
    column, row, shelf = 0, 0, 0
    for index in sorted(range(len(sizes)), key=lambda index: -sizes[index][1]):
        w, h = sizes[index]
        if column + w + gap > width:
            column, row, shelf = 0, row + shelf, 0
        corners[index] = (column + PADDING, row + PADDING)
        column, shelf = column + w + gap, max(shelf, h + gap)
    return corners, row + shelf, width


def _panels(plan: FloorPlan, index: int) -> Iterator[Panel]:
    room = plan.rooms[index]
    doorways, windows = plan.doorways_of(index), plan.windows_of(index)
    x0, y0, x1, y1 = room.bounds
    yield Panel(2, 1, (x0, y0, 0.0), (x1, y1, 0.0), "floor")
    yield Panel(2, -1, (x0, y0, plan.height), (x1, y1, plan.height), "ceiling")
    for axis, sign in product((0, 1), (-1, 1)):
        holes = [_doorway_box(d) for d in doorways if _side(d, index) == (axis, sign)]
        glass = [_window_box(room, w) for w in windows if (w.axis, w.sign) == (axis, sign)]
        yield _wall(room, axis, sign, plan.height, (*holes, *glass))
        yield from _skirting(room, axis, sign, holes)
    for doorway in doorways:
        yield from _casing(doorway, room, index)
        if doorway.rooms[0] == index:
            yield from _reveal(_doorway_box(doorway), doorway.axis, "trim", "threshold")
    for window in windows:
        yield from _window(room, window)


def _side(doorway: Doorway, room: int) -> tuple[int, int]:
    return doorway.axis, 1 if doorway.rooms[0] == room else -1


def _wall(room: Room, axis: int, sign: int, height: float, holes: tuple[Box, ...]) -> Panel:
    at = _face(room, axis, sign)
    low, high = _span(room, axis)
    return Panel(
        axis, -sign, _point(axis, at, low, 0.0), _point(axis, at, high, height), "wall", holes
    )


def _skirting(room: Room, axis: int, sign: int, holes: Sequence[Box]) -> Iterator[Panel]:
    low, high = _span(room, axis)
    gaps = sorted((hole[0][1 - axis] - CASING, hole[1][1 - axis] + CASING) for hole in holes)
    ends = [low, *(end for gap in gaps for end in gap), high]
    at = _face(room, axis, sign)
    for start, stop in zip(ends[::2], ends[1::2], strict=True):
        if stop > start:
            front = _point(axis, at - 0.015 * sign, stop, 0.08)
            box = _ordered(_point(axis, at, start, 0.0), front)
            yield from _box(box, "trim", ((axis, -sign), (2, 1)))


CASING = 0.07


def _casing(doorway: Doorway, room: Room, index: int) -> Iterator[Panel]:
    """The flat frame around a doorway on one room's side."""
    axis, sign = _side(doorway, index)
    at = _face(room, axis, sign)
    front = at - 0.02 * sign
    start, stop = doorway.centre - doorway.width / 2, doorway.centre + doorway.width / 2
    top = doorway.height + CASING
    sides = ((axis, -sign), (1 - axis, -1), (1 - axis, 1))
    for a, b in ((start - CASING, start), (stop, stop + CASING)):
        box = _ordered(_point(axis, at, a, 0.0), _point(axis, front, b, top))
        yield from _box(box, "trim", sides)
    box = _ordered(_point(axis, at, start, doorway.height), _point(axis, front, stop, top))
    yield from _box(box, "trim", ((axis, -sign), (2, -1)))


def _reveal(box: Box, axis: int, sides: str, bottom: str) -> Iterator[Panel]:
    """The four inner faces of an opening through a wall."""
    (low, high), along = box, 1 - axis
    for face, material in (((along, 1), sides), ((along, -1), sides), ((2, -1), sides)):
        yield _side_of((low, high), face[0], face[1], inside=True, material=material)
    yield _side_of(box, 2, 1, inside=True, material=bottom)


def _window(room: Room, window: Window) -> Iterator[Panel]:
    """A reveal and a frame with one mullion around the pane, which is a light (`pane`)."""
    box = _window_box(room, window)
    axis, along, bar = window.axis, 1 - window.axis, 0.05
    yield from _reveal(box, axis, "trim", "trim")
    back = box[1][axis] if window.sign > 0 else box[0][axis]
    front = back - 0.04 * window.sign
    (a, b), (c, d) = (box[0][along], box[1][along]), (box[0][2], box[1][2])
    middle = (a + b) / 2
    bars = [(a, a + bar, c, d), (b - bar, b, c, d), (a, b, c, c + bar), (a, b, d - bar, d)]
    if b - a > 1.0:
        bars.append((middle - bar / 2, middle + bar / 2, c, d))
    sides = ((axis, -window.sign), (along, -1), (along, 1), (2, -1), (2, 1))
    for u0, u1, v0, v1 in bars:
        piece = _ordered(_point(axis, back, u0, v0), _point(axis, front, u1, v1))
        yield from _box(piece, "trim", sides)


def pane(plan: FloorPlan, window: Window) -> Box:
    """The glass of a window, flat on the window's axis at the outer end of its reveal."""
    low, high = _window_box(plan.rooms[window.room], window)
    at = (high if window.sign > 0 else low)[window.axis]
    return (
        _point(window.axis, at, low[1 - window.axis], window.sill),
        _point(window.axis, at, high[1 - window.axis], window.head),
    )


def _doorway_box(doorway: Doorway) -> Box:
    """The opening: the wall's thickness along the axis, width and height."""
    half, width = WALL_THICKNESS / 2, doorway.width / 2
    return (
        _point(doorway.axis, doorway.wall - half, doorway.centre - width, 0.0),
        _point(doorway.axis, doorway.wall + half, doorway.centre + width, doorway.height),
    )


def _window_box(room: Room, window: Window) -> Box:
    at = _face(room, window.axis, window.sign)
    start, stop = window.centre - window.width / 2, window.centre + window.width / 2
    outer = at + WALL_THICKNESS * window.sign
    return _ordered(
        _point(window.axis, at, start, window.sill),
        _point(window.axis, outer, stop, window.head),
    )


def _box(box: Box, material: str, sides: Sequence[tuple[int, int]]) -> Iterator[Panel]:
    for axis, sign in sides:
        yield _side_of(box, axis, sign, inside=False, material=material)


def _side_of(box: Box, axis: int, sign: int, *, inside: bool, material: str) -> Panel:
    """The side of a box whose normal is `sign` along `axis`, seen from inside or outside."""
    at = box[(sign > 0) != inside][axis]
    low, high = (tuple(at if k == axis else p[k] for k in range(3)) for p in box)
    return Panel(axis, sign, (low[0], low[1], low[2]), (high[0], high[1], high[2]), material)


def _ordered(a: Point, b: Point) -> Box:
    low, high = np.minimum(a, b).tolist(), np.maximum(a, b).tolist()
    return (low[0], low[1], low[2]), (high[0], high[1], high[2])


def _face(room: Room, axis: int, sign: int) -> float:
    return room.bounds[axis + 2] if sign > 0 else room.bounds[axis]


def _span(room: Room, axis: int) -> tuple[float, float]:
    return room.bounds[1 - axis], room.bounds[3 - axis]


def _point(axis: int, at: float, along: float, z: float) -> Point:
    return (at, along, z) if axis == 0 else (along, at, z)
