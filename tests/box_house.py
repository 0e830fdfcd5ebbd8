"""A house of boxes for tests of paths and language: four rooms, fifteen objects, 36 viewpoints."""

from itertools import product

import numpy as np
import trimesh

from vlnhijack.navigation.graph import NavigationGraph
from vlnhijack.scenes.house import House, HouseObject, Room
from vlnhijack.scenes.surface import Surface

Box = tuple[float, float, float, float, float]  # x0, y0, x1, y1, height; on the floor

SIDE = 6.0  # of a room; the inner walls run along the axes, doors are in their middle
LABELS = {(0, 0): "bedroom", (1, 0): "kitchen", (0, 1): "living room", (1, 1): "hallway"}
FURNITURE: dict[tuple[int, int], list[tuple[str, tuple[float, ...]]]] = {
    (0, 0): [
        ("bed", (0.1, 0.1, 2.0, 0.5, 0.6)),
        ("lamp", (0.1, 5.4, 0.5, 5.8, 1.6)),
        ("cabinet", (5.3, 0.3, 5.8, 1.6, 1.2)),
        ("plant", (2.8, 2.8, 3.2, 3.2, 1.0)),
    ],
    (1, 0): [
        ("table", (2.6, 2.6, 3.4, 3.4, 0.8)),
        ("chair", (3.6, 2.8, 4.0, 3.2, 0.9)),
        ("fridge", (5.3, 5.2, 5.9, 5.9, 1.8)),
        ("counter", (4.0, 0.1, 5.9, 0.6, 0.9)),
    ],
    (0, 1): [
        ("sofa", (0.1, 2.0, 0.6, 4.0, 0.8)),
        ("tv_monitor", (2.5, 5.6, 3.6, 5.8, 1.4)),
        ("rug", (2.3, 2.3, 3.7, 3.7, 0.02)),
        ("table", (2.7, 2.7, 3.3, 3.3, 0.5)),
    ],
    (1, 1): [
        ("shelf", (5.4, 2.0, 5.9, 3.5, 1.8)),
        ("plant", (0.2, 5.3, 0.7, 5.8, 1.2)),
        ("chair", (5.2, 5.2, 5.8, 5.8, 0.9)),
    ],
}


def walls() -> list[Box]:
    """Outer and inner walls, 2.5 m high and 0.1 m thick, with four door gaps of 1.4 m."""
    long, thin = 2 * SIDE, 0.05
    outer: list[Box] = [
        (-0.1, -0.1, 0.0, long, 2.5), (long, -0.1, long + 0.1, long, 2.5),
        (-0.1, -0.1, long, 0.0, 2.5), (-0.1, long, long, long + 0.1, 2.5),
    ]  # fmt: skip
    pieces = [(0.0, 0.5), (1.9, 6.5), (7.9, long)]
    upright: list[Box] = [(SIDE - thin, a, SIDE + thin, b, 2.5) for a, b in pieces]
    level: list[Box] = [(a, SIDE - thin, b, SIDE + thin, 2.5) for a, b in pieces]
    return outer + upright + level


def objects() -> dict[str, tuple[str, str, Box]]:
    """Category, room id and box of every object."""
    found: dict[str, tuple[str, str, Box]] = {}
    for (column, row), things in FURNITURE.items():
        dx, dy = column * SIDE, row * SIDE
        for number, (category, (x0, y0, x1, y1, height)) in enumerate(things):
            box = (x0 + dx, y0 + dy, x1 + dx, y1 + dy, height)
            found[f"{category}_{column}{row}{number}"] = (category, f"room_{column}{row}", box)
    return found


def box_house() -> House:
    """The house; viewpoints stand on a 2 m grid, joined where no wall or furniture between."""
    things = objects()
    shells = [_surface(f"wall_{n}", box, None) for n, box in enumerate(walls())]
    return House(
        name="boxes",
        kind="baked",
        surfaces=(*shells, *(_surface(i, box, i) for i, (_, _, box) in things.items())),
        objects=tuple(
            HouseObject(i, category, room, _centre(box), _size(box))
            for i, (category, room, box) in things.items()
        ),
        rooms=tuple(
            Room(f"room_{c}{r}", label, (c * SIDE, r * SIDE, (c + 1) * SIDE, (r + 1) * SIDE))
            for (c, r), label in LABELS.items()
        ),
        graph=_graph(),
    )


def blocked(start: np.ndarray, end: np.ndarray, box: Box) -> bool:
    """Whether the segment between two points (x, y, z) meets a box."""
    low, high = np.array([*box[:2], 0.0]), np.array([*box[2:4], box[4]])
    step = np.where(end == start, 1e-12, end - start)
    near, far = np.sort([(low - start) / step, (high - start) / step], axis=0)
    return bool(max(near.max(), 0.0) <= min(far.min(), 1.0))


def _graph() -> NavigationGraph:
    ticks = (1.2, 3.9, 4.6, 7.2, 9.9, 10.7)
    points = np.array([(x, y, 1.5) for x, y in product(ticks, ticks)])
    adjacency = np.zeros((len(points),) * 2, bool)
    obstacles = walls() + [box for _, _, box in objects().values() if box[4] > 0.1]
    low = np.array([0.0, 0.0, -1.3])  # people walk at knee height
    for i, j in product(range(len(points)), repeat=2):
        if i != j and np.linalg.norm(points[i] - points[j]) <= 2.8:
            clear = not any(blocked(points[i] + low, points[j] + low, box) for box in obstacles)
            adjacency[i, j] = clear
    names = tuple(f"v{row:02d}" for row in range(len(points)))
    return NavigationGraph("boxes", names, points, adjacency, np.full(len(points), 1.5))


def _centre(box: Box) -> tuple[float, float, float]:
    return ((box[0] + box[2]) / 2, (box[1] + box[3]) / 2, box[4] / 2)


def _size(box: Box) -> tuple[float, float, float]:
    return (box[2] - box[0], box[3] - box[1], box[4])


def _surface(name: str, box: Box, object_id: str | None) -> Surface:
    mesh = trimesh.creation.box(_size(box)).apply_translation(_centre(box))
    vertices = np.asarray(mesh.vertices, np.float32)
    uv = np.zeros((len(vertices), 2), np.float32)
    texture = np.full((1, 1, 3), 0.5, np.float32)
    return Surface(name, vertices, np.asarray(mesh.faces, np.int32), uv, texture, object_id)
