"""Where a piece of furniture may stand in one room, and the ways to put it there."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from vlnhijack.frames import direction
from vlnhijack.scenes.house import Room
from vlnhijack.scenes.procedural.floor_plan import FloorPlan
from vlnhijack.scenes.procedural.furniture import make_piece
from vlnhijack.scenes.procedural.furniture.piece import Piece
from vlnhijack.scenes.procedural.viewpoints import distance_to_boxes, walkable
from vlnhijack.scenes.walking import CLEARANCE

FLAT = 0.15
OVERHEAD = 1.9
GRID = 0.1

Array = NDArray[np.float64]
Spot = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Placement:
    """A piece in a room: its base centre (metres) and the heading of its front (radians)."""

    piece: Piece
    room: int
    position: Spot
    heading: float
    large: bool

    @property
    def box(self) -> Array:
        """World bounds (6,): x0, y0, z0, x1, y1, z1."""
        width, depth, height = self.piece.size
        sine, cosine = abs(np.sin(self.heading)), abs(np.cos(self.heading))
        half = np.array([width * cosine + depth * sine, width * sine + depth * cosine]) / 2
        x, y, z = self.position
        return np.array([x - half[0], y - half[1], z, x + half[0], y + half[1], z + height])

    @property
    def vertices(self) -> Array:
        """The piece's vertices (N,3) in the world."""
        turned = self.piece.mesh.turned("z", -self.heading)
        return turned.moved(*self.position).vertices

    @property
    def blocks(self) -> bool:
        """Whether a walker has to go around it."""
        return self.box[5] > FLAT and self.box[2] < OVERHEAD


@dataclass
class RoomLayout:
    """One room that is being furnished."""

    plan: FloorPlan
    index: int
    rng: np.random.Generator
    placed: list[Placement] = field(default_factory=list)

    def __post_init__(self) -> None:
        x0, y0, x1, y1 = self.room.bounds
        grid = np.meshgrid(
            np.arange(x0 - 0.2, x1 + 0.2, GRID), np.arange(y0 - 0.2, y1 + 0.2, GRID), indexing="ij"
        )
        self._grid = np.stack(grid, axis=-1)
        open_floor = walkable(self.plan, self._grid.reshape(-1, 2))
        self._open = open_floor.reshape(self._grid.shape[:2])

    @property
    def room(self) -> Room:
        return self.plan.rooms[self.index]

    def against_wall(
        self, category: str, *, large: bool = False, z: float = 0.0, corner: bool = False
    ) -> Placement | None:
        """Back to a random wall, looking into the room; hung at z metres if z > 0."""
        piece = make_piece(category, self.rng, large=large)
        return self._first(piece, self._wall_spots(piece, z, corner), large)

    def in_the_middle(self, category: str, *, large: bool = False) -> Placement | None:
        """Free-standing, as near to the room's centre as it fits."""
        piece = make_piece(category, self.rng, large=large)
        x0, y0, x1, y1 = self.room.bounds
        turn = 0.0 if x1 - x0 > y1 - y0 else np.pi / 2
        shifts = sorted(product(np.arange(-0.9, 0.91, 0.15), repeat=2), key=np.linalg.norm)
        middle = ((x0 + x1) / 2, (y0 + y1) / 2)
        spots = ((middle[0] + a, middle[1] + b, 0.0, turn) for a, b in shifts)
        return self._first(piece, spots, large)

    def opposite(
        self, host: Placement, category: str, *, large: bool = False, z: float = 0.0
    ) -> Placement | None:
        """Against the wall that `host` looks at, on its axis or up to 0.6 m aside."""
        piece = make_piece(category, self.rng, large=large)
        ahead, aside = _axes(host.heading)
        depth = piece.size[1] / 2 + (0.005 if z > 0 else 0.03)
        reach = self._distance_to_wall(host.position, ahead) - depth
        shifts = sorted(np.arange(-0.6, 0.61, 0.15), key=abs)
        spots = (
            (
                *(np.array(host.position[:2]) + reach * ahead + shift * aside),
                z,
                host.heading + np.pi,
            )
            for shift in shifts
        )
        return self._first(piece, spots, large)

    def in_front(
        self,
        host: Placement,
        category: str,
        gap: float,
        *,
        large: bool = False,
        facing: bool = False,
    ) -> Placement | None:
        """`gap` metres before the host's front, tucked in if negative; turned to it if `facing`."""
        piece = make_piece(category, self.rng, large=large)
        ahead, aside = _axes(host.heading)
        centre = np.array(host.position[:2])
        reach = host.piece.size[1] / 2 + piece.size[1] / 2 + gap
        heading = host.heading + (np.pi if facing else 0.0)
        spots = (
            (*(centre + reach * ahead + shift * aside), 0.0, heading)
            for shift in (0.0, 0.15, -0.15, 0.3, -0.3, 0.45, -0.45)
        )
        return self._first(piece, spots, large, touching=host if gap < 0 else None)

    def beside(self, host: Placement, category: str, *, large: bool = False) -> Placement | None:
        """Next to the host, looking the same way, backs in line."""
        piece = make_piece(category, self.rng, large=large)
        ahead, aside = _axes(host.heading)
        shift = (host.piece.size[0] + piece.size[0]) / 2 + 0.08
        back = (piece.size[1] - host.piece.size[1]) / 2
        spots = (
            (
                *(np.array(host.position[:2]) + back * ahead + sign * shift * aside),
                0.0,
                host.heading,
            )
            for sign in self.rng.permutation([-1, 1])
        )
        return self._first(piece, spots, large)

    def around(self, table: Placement, category: str, count: int, *, large: bool = False) -> None:
        """Up to `count` pieces tucked under the sides of a table, looking at it."""
        width, depth, _ = table.piece.size
        sides = [(0.0, depth), (np.pi, depth), (np.pi / 2, width), (-np.pi / 2, width)]
        seated = 0
        for row in self.rng.permutation(4):
            if seated == count:
                return
            turn, extent = sides[row]
            piece = make_piece(category, self.rng, large=large)
            heading = table.heading + turn
            ahead, _ = _axes(heading)
            reach = extent / 2 + piece.size[1] / 2 - 0.12
            place = np.array(table.position[:2]) - reach * ahead
            placed = self._first(piece, [(*place, 0.0, heading)], large, touching=table)
            seated += placed is not None

    def on_top(self, host: Placement, category: str) -> Placement | None:
        """A small piece on the host's top, if it is at most 1.1 m high."""
        piece = make_piece(category, self.rng, large=False)
        top = float(host.box[5])
        if top > 1.1 or piece.size[0] > host.piece.size[0] or piece.size[1] > host.piece.size[1]:
            return None
        x, y, _ = host.position
        return self._first(piece, [(x, y, top, host.heading)], False, touching=host)

    def _first(
        self,
        piece: Piece,
        spots: Iterable[tuple[float, float, float, float]],
        large: bool,
        touching: Placement | None = None,
    ) -> Placement | None:
        """Put the piece at the first spot (x, y, z, heading) where it fits."""
        for x, y, z, heading in spots:
            place = (float(x), float(y), float(z))
            placement = Placement(piece, self.index, place, float(heading), large)
            if self._fits(placement, touching):
                self.placed.append(placement)
                return placement
        return None

    def _wall_spots(
        self, piece: Piece, z: float, corner: bool
    ) -> list[tuple[float, float, float, float]]:
        """Spots along the four walls, every 0.15 m, or next to the corners, in random order."""
        width, depth, _ = piece.size
        x0, y0, x1, y1 = self.room.bounds
        back = depth / 2 + (0.005 if z > 0 else 0.03)
        spots = []
        for axis, sign in product((0, 1), (-1, 1)):
            low, high = (y0, y1) if axis == 0 else (x0, x1)
            low, high = low + width / 2 + 0.04, high - width / 2 - 0.04
            if high < low:
                continue
            along = np.array([low, high]) if corner else np.arange(low, high + 1e-9, 0.15)
            at = ((x1, y1) if sign > 0 else (x0, y0))[axis] - sign * back
            heading = [-sign * np.pi / 2, np.pi if sign > 0 else 0.0][axis]
            spots += [(at, a, z, heading) if axis == 0 else (a, at, z, heading) for a in along]
        return [spots[row] for row in self.rng.permutation(len(spots))]

    def _fits(self, new: Placement, touching: Placement | None) -> bool:
        box = new.box
        x0, y0, x1, y1 = self.room.bounds
        if box[0] < x0 or box[1] < y0 or box[3] > x1 or box[4] > y1 or box[5] > self.plan.height:
            return False
        if any(_overlap(box, zone) for zone in self._zones()):
            return False
        for other in self.placed:
            carpet = other.piece.category == "rug" or new.piece.category == "rug"
            if other is not touching and not carpet and _overlap(box, other.box, 0.03):
                return False
        return not new.blocks or self._stays_walkable(new)

    def _zones(self) -> Iterator[Array]:
        """Boxes that furniture keeps out of: the way through doorways, the light of windows."""
        for doorway in self.plan.doorways_of(self.index):
            half, reach = doorway.width / 2 + 0.08, 0.8
            along = (doorway.centre - half, doorway.centre + half)
            across = (doorway.wall - reach, doorway.wall + reach)
            yield _zone(doorway.axis, across, along, 0.0, doorway.height + 0.1)
        for window in self.plan.windows_of(self.index):
            half = window.width / 2 + 0.05
            wall = self.room.bounds[window.axis + (2 if window.sign > 0 else 0)]
            along = (window.centre - half, window.centre + half)
            across = (wall - 0.35, wall + 0.35)
            yield _zone(window.axis, across, along, window.sill + 0.05, window.head + 0.1)

    def _stays_walkable(self, new: Placement) -> bool:
        """Whether one walkable area still joins all doorways and holds most of the free floor."""
        boxes = np.array([p.box[[0, 1, 3, 4]] for p in (*self.placed, new) if p.blocks])
        clear = distance_to_boxes(self._grid.reshape(-1, 2), boxes) >= CLEARANCE
        areas, _ = ndimage.label(self._open & clear.reshape(self._open.shape))
        entries = {self._area_at(areas, d.position) for d in self.plan.doorways_of(self.index)}
        sizes = np.bincount(areas.ravel())[1:]
        if len(entries) != 1 or 0 in entries or len(sizes) == 0:
            return False
        return bool(sizes[entries.pop() - 1] > max(0.85 * sizes.sum(), 0.4 * self._open.sum()))

    def _area_at(self, areas: NDArray[np.int32], place: tuple[float, float]) -> int:
        gaps = np.linalg.norm(self._grid - np.array(place), axis=-1)
        return int(areas[np.unravel_index(gaps.argmin(), gaps.shape)])

    def _distance_to_wall(self, place: Spot, ahead: Array) -> float:
        axis = int(np.abs(ahead).argmax())
        wall = self.room.bounds[axis + (2 if ahead[axis] > 0 else 0)]
        return abs(wall - place[axis])


def _axes(heading: float) -> tuple[Array, Array]:
    """Unit vectors (2,) ahead and to the right."""
    return direction(heading)[:2], direction(heading + np.pi / 2)[:2]


def _zone(
    axis: int, across: tuple[float, float], along: tuple[float, float], low: float, high: float
) -> Array:
    (a0, a1), (b0, b1) = (across, along) if axis == 0 else (along, across)
    return np.array([a0, b0, low, a1, b1, high])


def _overlap(a: Array, b: Array, gap: float = 0.0) -> bool:
    return bool((a[:3] < b[3:] + gap).all() and (b[:3] < a[3:] + gap).all())
