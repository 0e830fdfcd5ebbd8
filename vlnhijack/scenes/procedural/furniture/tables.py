"""Dining, coffee and side tables, and desks."""

import numpy as np

from vlnhijack.scenes.procedural.furniture.piece import Part, Piece, assemble
from vlnhijack.scenes.procedural.furniture.seating import corners, legs
from vlnhijack.scenes.procedural.materials import (
    FABRICS,
    FLOWERS,
    PAINTS,
    WOODS,
    Material,
    ceramic,
    fabric,
    glazed,
    leaves,
    marble,
    metal,
    pick,
    solid,
    wood,
)
from vlnhijack.scenes.procedural.shapes import (
    Mesh,
    box,
    cushion,
    join,
    lathe,
    leaf,
    loft,
    rectangle,
)


def table(rng: np.random.Generator, large: bool) -> Piece:
    """A dining, round or coffee table; large: 1.8 m and more, some with a long cloth."""
    if large:
        return _cloth_table(rng) if rng.random() < 0.6 else _dining_table(rng, True)
    return [_dining_table, _round_table, _coffee_table][rng.integers(3)](rng, False)


def _top_material(rng: np.random.Generator) -> Material:
    choice = rng.random()
    if choice < 0.65:
        return wood(rng, axis=0)
    return marble(rng) if choice < 0.8 else solid(pick(rng, PAINTS))


def _crockery(rng: np.random.Generator, places: list[tuple[float, float]], z: float) -> list[Part]:
    """Plates at places (x, y) and a bowl of fruit in the middle."""
    plate = [(0.05, 0.0), (0.12, 0.018), (0.115, 0.02), (0.05, 0.008)]
    plates = join(lathe(plate, 14, (x, y, z)) for x, y in places)
    bowl = [(0.05, 0.0), (0.1, 0.04), (0.14, 0.09), (0.13, 0.09), (0.08, 0.05)]
    fruit = [(0.0, 0.0), (0.035, 0.015), (0.045, 0.04), (0.03, 0.075), (0.0, 0.08)]
    fruits = join(
        lathe(fruit, 8, (0.05 * np.cos(a), 0.05 * np.sin(a), z + 0.05)) for a in (0.4, 2.6, 4.7)
    )
    colour = pick(rng, [(0.85, 0.2, 0.12), (0.9, 0.55, 0.1), (0.5, 0.7, 0.2)])
    return [
        Part(plates, ceramic(rng)),
        Part(lathe(bowl, 14, (0.0, 0.0, z)), glazed(rng)),
        Part(fruits, solid(colour)),
    ]


def _vase(rng: np.random.Generator, z: float) -> list[Part]:
    """A vase of flowers in the middle of a table top at height z."""
    profile = [(0.05, 0.0), (0.08, 0.08), (0.07, 0.15), (0.04, 0.2), (0.05, 0.24), (0.04, 0.235)]
    stems, heads = [], []
    for a in np.arange(7) * 2 * np.pi / 7:
        lean = rng.uniform(0.15, 0.5)
        stem = leaf(rng.uniform(0.15, 0.25), 0.05, -0.3, segments=3).turned("x", 1.2 - lean)
        stems.append(stem.turned("z", a).moved(0.0, 0.0, z + 0.22))
        x, y = 0.14 * np.cos(a + 0.4), 0.14 * np.sin(a + 0.4)
        bloom = [(0.01, 0.0), (0.045, 0.03), (0.05, 0.055), (0.02, 0.05)]
        heads.append(lathe(bloom, 7, (x, y, z + rng.uniform(0.34, 0.46))))
    return [
        Part(lathe(profile, 12, (0.0, 0.0, z)), glazed(rng)),
        Part(join(stems), leaves(rng, 0.06, z + 0.4)),
        Part(join(heads), solid(pick(rng, FLOWERS))),
    ]


def _dining_table(rng: np.random.Generator, large: bool) -> Piece:
    width = rng.uniform(1.9, 2.3) if large else rng.uniform(1.3, 1.7)
    depth, height = rng.uniform(0.8, 1.0), 0.75
    timber = _top_material(rng)
    thick = rng.uniform(0.05, 0.1)
    base = join(
        [
            legs(width - 0.06, depth - 0.06, height - 0.02, thick),
            box(width - 0.2, depth - 0.2, 0.08, (0.0, 0.0, height - 0.1)),
        ]
    )
    under = wood(rng) if rng.random() < 0.6 else metal(rng)
    top = cushion(width, depth, 0.04, 0.012, (0.0, 0.0, height - 0.03))
    seats = corners(width * 0.6, depth, 0.18)
    extra = _crockery(rng, seats, height + 0.009) if rng.random() < 0.5 else _vase(rng, height)
    return assemble("table", Part(base, under), Part(top, timber), *extra)


def _round_table(rng: np.random.Generator, large: bool) -> Piece:
    radius, height = rng.uniform(0.45, 0.65), rng.uniform(0.7, 0.76)
    foot = [
        (0.32, 0.0), (0.3, 0.03), (0.08, 0.06), (0.05, 0.2), (0.07, 0.4), (0.05, 0.6),
        (0.12, height - 0.02),
    ]  # fmt: skip
    rim = [(radius - 0.02, 0.0), (radius, 0.01), (radius, 0.03), (radius - 0.01, 0.04)]
    top = lathe(rim, 28, (0.0, 0.0, height - 0.03))
    return assemble(
        "table", Part(lathe(foot, 14), wood(rng)), Part(top, _top_material(rng)),
        *_vase(rng, height + 0.009),
    )  # fmt: skip


def _coffee_table(rng: np.random.Generator, large: bool) -> Piece:
    width, depth = rng.uniform(0.9, 1.3), rng.uniform(0.5, 0.7)
    height = rng.uniform(0.38, 0.46)
    timber = _top_material(rng)
    base = legs(width - 0.05, depth - 0.05, height - 0.02, 0.05)
    shelf = box(width - 0.1, depth - 0.1, 0.02, (0.0, 0.0, 0.12))
    top = cushion(width, depth, 0.04, 0.015, (0.0, 0.0, height - 0.03))
    books = [
        Part(
            box(0.24 - 0.02 * i, 0.17, 0.035, (0.28, 0.0, height + 0.008 + 0.033 * i)).turned(
                "z", 0.2 * i, (0.28, 0.0, 0.0)
            ),
            solid(pick(rng, FABRICS)),
        )
        for i in range(rng.integers(0, 4))
    ]
    frame = wood(rng) if rng.random() < 0.6 else metal(rng)
    return assemble(
        "table", Part(base, frame), Part(shelf, timber), Part(top, timber), *books,
        *_vase(rng, height + 0.009),
    )  # fmt: skip


def _cloth(width: float, depth: float, height: float, drop: float) -> Mesh:
    """A tablecloth that hangs by `drop` metres in folds."""
    ring = rectangle(width, depth, 0.0, 0.08, 4)
    side = np.linspace(0, 1, 13)[1:-1]
    dense = []
    for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True):
        dense.append(a)
        if np.linalg.norm(b - a) > 0.3:
            dense += [a + (b - a) * t for t in side]
    outline = np.roll(dense, -2, axis=0)
    outward = outline / np.linalg.norm(outline, axis=1, keepdims=True)
    wave = np.where(np.arange(len(outline)) % 2, 0.035, -0.015)[:, None] * outward
    up = np.array([0.0, 0.0, 1.0])
    hem = outline * 1.03 + wave + (height - drop) * up
    return loft(
        [
            outline * 0.9 + (height - drop + 0.01) * up,
            hem,
            outline * 1.01 + 0.3 * wave + (height - 0.08) * up,
            outline + height * up,
            outline * 0.6 + (height + 0.003) * up,
        ]
    )


def _cloth_table(rng: np.random.Generator) -> Piece:
    width, depth, height = rng.uniform(1.8, 2.2), rng.uniform(0.9, 1.05), 0.76
    drop = rng.uniform(0.25, 0.72)
    cloth = _cloth(width, depth, height, drop)
    seats = [*corners(width * 0.6, depth, 0.18), (-0.8, 0.0), (0.8, 0.0)]
    return assemble(
        "table",
        Part(legs(width - 0.15, depth - 0.15, height - 0.06, 0.09), wood(rng)),
        Part(cloth, fabric(rng)),
        *_crockery(rng, seats, height + 0.005),
    )


def desk(rng: np.random.Generator, large: bool) -> Piece:
    """A writing desk with drawers on one side, a laptop or papers and books on top."""
    width, depth, height = rng.uniform(1.1, 1.5), rng.uniform(0.55, 0.7), 0.75
    timber = wood(rng, pick(rng, WOODS), 0)
    side = width / 2 - 0.21
    top = cushion(width, depth, 0.04, 0.01, (0.0, 0.0, height - 0.03))
    chest = box(0.38, depth - 0.08, height - 0.05, (side, 0.0, 0.03))
    panel = box(0.04, depth - 0.08, height - 0.02, (-width / 2 + 0.05, 0.0, 0.0))
    rear = box(width - 0.3, 0.02, 0.35, (-0.1, -depth / 2 + 0.07, height - 0.37))
    front = depth / 2 - 0.04
    drawers, knobs = [], []
    for i in range(3):
        z = 0.06 + 0.215 * i
        drawers.append(box(0.34, 0.03, 0.195, (side, front, z)))
        knobs.append(box(0.1, 0.03, 0.02, (side, front + 0.025, z + 0.12)))
    parts = [
        Part(join([top, chest, panel, rear]), timber),
        Part(join(drawers), wood(rng, axis=0) if rng.random() < 0.4 else timber),
        Part(join(knobs), metal(rng)),
    ]
    lid = box(0.334, 0.012, 0.23).turned("x", 0.25).moved(-0.1, -0.12, height + 0.015)
    screen = box(0.31, 0.006, 0.2).turned("x", 0.25).moved(-0.1, -0.112, height + 0.03)
    keyboard = box(0.34, 0.24, 0.015, (-0.1, 0.0, height + 0.008))
    parts += [
        Part(join([lid, keyboard]), metal(rng, (0.5, 0.5, 0.52))),
        Part(screen, solid((0.3, 0.5, 0.75))),
    ]
    stack = [(box(0.2, 0.27, 0.035, (-0.42, -0.05, height + 0.008 + 0.034 * i))) for i in range(3)]
    parts += [Part(book, solid(pick(rng, FABRICS))) for book in stack]
    return assemble("desk", *parts)
