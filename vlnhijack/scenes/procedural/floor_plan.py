"""Floor plans: rectangular rooms, the doorways between them and the windows to the outside."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import networkx as nx
import numpy as np

from vlnhijack.scenes.house import Room

WALL_THICKNESS = 0.12
DOOR_HEIGHT = 2.1
SMALLEST_SIDE = 2.5

Cell = tuple[float, float, float, float]


@dataclass(frozen=True)
class Doorway:
    """An opening between two rooms, the one with the smaller coordinate first.

    The wall's centre line is at `wall` on `axis` (0: x, 1: y); the opening is centred at `centre`
    on the other axis. Metres.
    """

    rooms: tuple[int, int]
    axis: int
    wall: float
    centre: float
    width: float
    height: float = DOOR_HEIGHT

    @property
    def position(self) -> tuple[float, float]:
        """The middle of the opening, (x, y)."""
        return (self.wall, self.centre) if self.axis == 0 else (self.centre, self.wall)


@dataclass(frozen=True)
class Window:
    """A window in a room's outer wall, on the side of smaller (-1) or larger (+1) `axis`."""

    room: int
    axis: int
    sign: int
    centre: float
    width: float
    sill: float
    head: float


@dataclass(frozen=True)
class FloorPlan:
    """Rooms with their inner bounds, doorways, windows and the ceiling's height in metres."""

    rooms: tuple[Room, ...]
    doorways: tuple[Doorway, ...]
    windows: tuple[Window, ...]
    height: float

    def doorways_of(self, room: int) -> list[Doorway]:
        return [doorway for doorway in self.doorways if room in doorway.rooms]

    def windows_of(self, room: int) -> list[Window]:
        return [window for window in self.windows if window.room == room]


def make_floor_plan(rng: np.random.Generator) -> FloorPlan:
    """Five to seven rooms on 113-139 m², joined by a spanning tree of doorways and some loops."""
    width, depth = rng.uniform(12.0, 13.4), rng.uniform(9.4, 10.4)
    outline = (0.0, 0.0, float(width), float(depth))
    cells, has_hallway = _cells(outline, rng)
    labels = _labels(cells, has_hallway, rng)
    rooms = tuple(
        Room(f"{label.replace(' ', '_')}_{row:02d}", label, _shrink(cell))
        for row, (cell, label) in enumerate(zip(cells, labels, strict=True))
    )
    height = float(rng.uniform(2.6, 2.8))
    return FloorPlan(
        rooms, _doorways(cells, labels, rng), tuple(_windows(cells, labels, outline, rng)), height
    )


def _cells(outline: Cell, rng: np.random.Generator) -> tuple[list[Cell], bool]:
    """Cells on the walls' centre lines; a hallway across the house, if there is one, is first."""
    has_hallway = bool(rng.random() < 0.6)
    hallway, cells = [], [outline]
    if has_hallway:
        x0, y0, x1, y1 = outline
        low = y0 + float(rng.uniform(0.37, 0.43)) * (y1 - y0)
        high = low + float(rng.uniform(1.75, 2.1))
        hallway, cells = [(x0, low, x1, high)], [(x0, y0, x1, low), (x0, high, x1, y1)]
    count = int(rng.integers(6, 8)) if has_hallway else int(rng.integers(5, 8))
    while len(cells) + len(hallway) < count:
        largest = max(range(len(cells)), key=lambda row: _area(cells[row]))
        cells[largest : largest + 1] = _split(cells[largest], rng)
    return hallway + cells, has_hallway


def _split(cell: Cell, rng: np.random.Generator) -> list[Cell]:
    x0, y0, x1, y1 = cell
    share = float(rng.uniform(0.38, 0.62))
    if x1 - x0 >= y1 - y0:
        cut = _within(x0 + share * (x1 - x0), x0, x1)
        return [(x0, y0, cut, y1), (cut, y0, x1, y1)]
    cut = _within(y0 + share * (y1 - y0), y0, y1)
    return [(x0, y0, x1, cut), (x0, cut, x1, y1)]


def _within(cut: float, low: float, high: float) -> float:
    return min(max(cut, low + SMALLEST_SIDE), high - SMALLEST_SIDE)


def _labels(cells: Sequence[Cell], has_hallway: bool, rng: np.random.Generator) -> list[str]:
    """One label a cell: the larger rooms are for living, the smallest is the bathroom."""
    extra = ["dining room", "office", "bedroom"]
    rng.shuffle(extra)
    free = list(range(int(has_hallway), len(cells)))
    chosen = ["living room", "bedroom", "kitchen", "bathroom", *extra][: len(free)]
    by_size = ["living room", "bedroom", "dining room", "kitchen", "office", "bathroom"]
    chosen.sort(key=by_size.index)
    free.sort(key=lambda row: -_area(cells[row]))
    labels = dict(zip(free, chosen, strict=True)) | ({0: "hallway"} if has_hallway else {})
    return [labels[row] for row in range(len(cells))]


def _doorways(
    cells: Sequence[Cell], labels: Sequence[str], rng: np.random.Generator
) -> tuple[Doorway, ...]:
    graph = nx.Graph()
    for pair in combinations(range(len(cells)), 2):
        shared = _shared_wall(cells[pair[0]], cells[pair[1]])
        if shared is not None and shared[3] - shared[2] > 1.7:
            private = 10 * sum(labels[room] == "bathroom" for room in pair)
            graph.add_edge(*pair, weight=private + float(rng.random()), shared=shared)
    tree = nx.minimum_spanning_tree(graph)
    loops = sorted(set(graph.edges) - set(tree.edges), key=lambda e: graph.edges[e]["weight"])
    wanted = [edge for edge in loops if graph.edges[edge]["weight"] < 0.85]
    chosen = [*tree.edges, *(wanted if len(wanted) > 2 else loops[:3])]
    return tuple(_doorway(edge, graph.edges[edge]["shared"], rng) for edge in chosen)


def _doorway(
    pair: tuple[int, int], shared: tuple[int, float, float, float, bool], rng: np.random.Generator
) -> Doorway:
    axis, wall, low, high, swapped = shared
    width = min(float(rng.uniform(0.9, 1.2)), high - low - 0.72)
    margin = 0.35 + width / 2
    centre = float(rng.uniform(low + margin, high - margin))
    rooms = (max(pair), min(pair)) if swapped else (min(pair), max(pair))
    return Doorway(rooms, axis, wall, centre, width)


def _shared_wall(a: Cell, b: Cell) -> tuple[int, float, float, float, bool] | None:
    """Axis, coordinate and free interval of the wall between two cells; True if b comes first."""
    half = WALL_THICKNESS / 2
    for axis in (0, 1):
        other = 1 - axis
        low = max(a[other], b[other]) + half
        high = min(a[other + 2], b[other + 2]) - half
        if high <= low:
            continue
        if np.isclose(a[axis + 2], b[axis]):
            return axis, a[axis + 2], low, high, False
        if np.isclose(b[axis + 2], a[axis]):
            return axis, a[axis], low, high, True
    return None


def _windows(
    cells: Sequence[Cell], labels: Sequence[str], outline: Cell, rng: np.random.Generator
) -> Iterator[Window]:
    for room, (cell, label) in enumerate(zip(cells, labels, strict=True)):
        for axis in (0, 1):
            for sign, side in ((-1, axis), (1, axis + 2)):
                if not np.isclose(cell[side], outline[side]):
                    continue
                low, high = cell[1 - axis], cell[3 - axis]
                private = label == "bathroom"
                width = min(0.7 if private else float(rng.uniform(1.2, 2.0)), high - low - 0.8)
                margin = 0.35 + width / 2
                centre = float(rng.uniform(low + margin, high - margin))
                sill = 1.5 if private else float(rng.uniform(0.8, 1.0))
                yield Window(room, axis, sign, centre, width, sill, 2.15)


def _shrink(cell: Cell) -> Cell:
    half = WALL_THICKNESS / 2
    x0, y0, x1, y1 = cell
    return (x0 + half, y0 + half, x1 - half, y1 - half)


def _area(cell: Cell) -> float:
    return (cell[2] - cell[0]) * (cell[3] - cell[1])
