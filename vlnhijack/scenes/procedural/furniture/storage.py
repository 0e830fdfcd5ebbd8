"""Cabinets, wardrobes, chests of drawers and bookcases."""

import numpy as np

from vlnhijack.scenes.procedural.furniture.piece import Part, Piece, assemble
from vlnhijack.scenes.procedural.furniture.seating import legs
from vlnhijack.scenes.procedural.materials import (
    FABRICS,
    PAINTS,
    WOODS,
    Material,
    glazed,
    metal,
    pick,
    shade,
    solid,
    wood,
)
from vlnhijack.scenes.procedural.shapes import (
    Mesh,
    ball,
    box,
    cylinder,
    join,
    lathe,
    loft,
    rectangle,
)


def cabinet(rng: np.random.Generator, large: bool) -> Piece:
    """A sideboard or a chest of drawers; large: a wardrobe of 1.2-2 m by 1.8-2.2 m."""
    if large:
        return _wardrobe(rng)
    return _sideboard(rng) if rng.random() < 0.6 else _chest(rng)


def _finish(rng: np.random.Generator, axis: int = 2) -> tuple[Material, Material]:
    """The materials of a carcass and of its panels."""
    if rng.random() < 0.65:
        colour = pick(rng, WOODS, 0.03)
        return wood(rng, colour, axis), wood(rng, shade(colour, rng.uniform(0.8, 1.25)), axis)
    colour = pick(rng, PAINTS)
    return solid(colour), solid(shade(colour, rng.uniform(0.8, 1.1)))


def door(width: float, height: float, at: tuple[float, float, float]) -> Mesh:
    """A cupboard door 3 cm thick, its panel set in a bevelled frame; faces +y; at: bottom centre
    of its back."""
    frame = min(0.08, 0.2 * width, 0.22 * height)
    sizes = [(0.0, 0.0), (0.0, 0.03), (frame, 0.03), (frame + 0.015, 0.02)]
    rings = [rectangle(width - 2 * f, height - 2 * f, y) for f, y in sizes]
    upright = loft(rings).turned("x", -np.pi / 2)
    return upright.moved(at[0], at[1], at[2] + height / 2)


def gaps(width: float, height: float, front: float, z: float) -> Part:
    """The dark that shows between doors: a sheet 3 mm in front of a carcass."""
    return Part(box(width, 0.02, height, (0.0, front - 0.007, z)), solid((0.08, 0.07, 0.06)))


def _handle(rng: np.random.Generator, x: float, y: float, z: float, kind: int) -> Mesh:
    """A knob, an upright bar or a lying bar in front of a door at depth y."""
    if kind == 0:
        return ball(0.018, (x, y + 0.018, z), 8)
    if kind == 1:
        return box(0.018, 0.035, 0.16, (x, y + 0.014, z - 0.08))
    return box(0.13, 0.035, 0.018, (x, y + 0.014, z - 0.009))


def _wardrobe(rng: np.random.Generator) -> Piece:
    width, depth, height = rng.uniform(1.2, 2.0), rng.uniform(0.5, 0.62), rng.uniform(1.8, 2.2)
    doors = int(np.round(width / rng.uniform(0.42, 0.6)))
    carcass, panel = _finish(rng)
    kind, plinth = int(rng.integers(2)), 0.08
    low = 0.24 if rng.random() < 0.4 else 0.0
    front = depth / 2
    body = box(width, depth, height - plinth - 0.02, (0.0, 0.0, plinth - 0.01))
    foot = box(width - 0.06, depth - 0.06, plinth, (0.0, 0.0, 0.0))
    cornice = box(width + 0.06, depth + 0.08, 0.06, (0.0, 0.01, height - 0.06))
    each = (width - 0.04) / doors
    fronts, knobs = [], []
    for i in range(doors):
        x = -width / 2 + 0.02 + each * (i + 0.5)
        top = height - plinth - 0.1 - low
        fronts.append(door(each - 0.016, top, (x, front - 0.012, plinth + 0.02 + low)))
        hinge = 1 if i % 2 else -1
        knobs.append(_handle(rng, x - hinge * (each / 2 - 0.06), front + 0.015, 1.05, kind))
        if low:
            fronts.append(door(each - 0.016, low - 0.02, (x, front - 0.012, plinth + 0.02)))
            knobs.append(_handle(rng, x, front + 0.0, plinth + 0.13, 2))
    return assemble(
        "cabinet",
        gaps(width - 0.04, height - plinth - 0.09, front, plinth + 0.015),
        Part(join([body, foot, cornice]), carcass),
        Part(join(fronts), panel),
        Part(join(knobs), metal(rng)),
    )


def _sideboard(rng: np.random.Generator) -> Piece:
    width, depth, height = rng.uniform(0.9, 1.6), rng.uniform(0.38, 0.48), rng.uniform(0.75, 0.95)
    foot = rng.uniform(0.08, 0.2)
    carcass, panel = _finish(rng, 0)
    columns = int(rng.integers(2, 5))
    each, kind, front = (width - 0.04) / columns, int(rng.integers(3)), depth / 2
    fronts, knobs = [], []
    for i in range(columns):
        x = -width / 2 + 0.02 + each * (i + 0.5)
        fronts.append(door(each - 0.015, 0.14, (x, front - 0.012, height - 0.2)))
        knobs.append(_handle(rng, x, front + 0.002, height - 0.13, 2))
        rest = height - foot - 0.25
        fronts.append(door(each - 0.015, rest, (x, front - 0.012, foot + 0.03)))
        hinge = 1 if i % 2 else -1
        knobs.append(
            _handle(rng, x - hinge * (each / 2 - 0.05), front + 0.015, foot + rest * 0.7, kind)
        )
    body = box(width, depth, height - foot - 0.02, (0.0, 0.0, foot))
    top = box(width + 0.04, depth + 0.05, 0.03, (0.0, 0.005, height - 0.03))
    return assemble(
        "cabinet",
        gaps(width - 0.05, height - foot - 0.07, front, foot + 0.025),
        Part(join([body, top, legs(width - 0.05, depth - 0.04, foot + 0.02, 0.05)]), carcass),
        Part(join(fronts), panel),
        Part(join(knobs), metal(rng)),
    )


def _chest(rng: np.random.Generator) -> Piece:
    width, depth, height = rng.uniform(0.7, 1.1), rng.uniform(0.42, 0.5), rng.uniform(0.8, 1.2)
    rows, columns = int(rng.integers(3, 6)), 1 if width < 0.85 else 2
    carcass, panel = _finish(rng, 0)
    front, each, tall = depth / 2, (width - 0.06) / columns, (height - 0.12) / rows
    fronts, knobs = [], []
    for row in range(rows):
        for column in range(columns):
            x, z = -width / 2 + 0.03 + each * (column + 0.5), 0.07 + tall * row
            fronts.append(box(each - 0.02, 0.035, tall - 0.02, (x, front, z)))
            for side in (-0.25, 0.25):
                knobs.append(_handle(rng, x + side * each, front + 0.012, z + tall / 2, 0))
    body = box(width, depth, height - 0.06, (0.0, 0.0, 0.05))
    top = box(width + 0.04, depth + 0.06, 0.03, (0.0, 0.01, height - 0.03))
    foot = box(width - 0.04, depth - 0.06, 0.07)
    return assemble(
        "cabinet",
        gaps(width - 0.06, height - 0.13, front, 0.065),
        Part(join([body, top, foot]), carcass),
        Part(join(fronts), panel),
        Part(join(knobs), metal(rng)),
    )


def nightstand(rng: np.random.Generator, large: bool) -> Piece:
    """A bedside chest with two drawers."""
    width, depth, height = rng.uniform(0.42, 0.55), rng.uniform(0.38, 0.42), rng.uniform(0.5, 0.6)
    carcass, panel = _finish(rng, 0)
    foot, front = 0.14, depth / 2
    fronts, knobs = [], []
    for z in (foot + 0.03, foot + (height - foot) / 2):
        fronts.append(box(width - 0.06, 0.035, (height - foot) / 2 - 0.05, (0.0, front, z)))
        knobs.append(_handle(rng, 0.0, front + 0.012, z + (height - foot) / 4 - 0.02, 0))
    body = box(width, depth, height - foot, (0.0, 0.0, foot))
    return assemble(
        "nightstand",
        Part(join([body, legs(width - 0.03, depth - 0.03, foot + 0.02, 0.045)]), carcass),
        Part(join(fronts), panel),
        Part(join(knobs), metal(rng)),
    )


def _row_of_books(
    rng: np.random.Generator, left: float, right: float, depth: float, z: float, room: float
) -> list[tuple[Mesh, int]]:
    """Books from x = left to right on a board at z, each with the index of its colour."""
    books, x = [], left + 0.01
    while x < right - 0.08:
        thick = rng.uniform(0.035, 0.065)
        tall = rng.uniform(0.68, 0.93) * room
        deep = rng.uniform(0.6, 0.8) * depth
        if rng.random() < 0.06:
            x += rng.uniform(0.1, 0.2)
            continue
        at = (x + thick / 2, (depth - deep) / 2 - 0.03, z)
        books.append((box(thick - 0.003, deep, tall, at), int(rng.integers(8))))
        x += thick
    return books


def shelf(rng: np.random.Generator, large: bool) -> Piece:
    """A bookcase with rows of books, a vase and a box."""
    width, depth = rng.uniform(0.8, 1.2), rng.uniform(0.28, 0.36)
    boards = int(rng.integers(4, 7))
    room = rng.uniform(0.31, 0.36)
    height = boards * room + 0.1
    frame, back = _finish(rng)
    sides = [box(0.03, depth, height, (s * (width / 2 - 0.015), 0.0, 0.0)) for s in (-1, 1)]
    levels = [0.06 + room * i for i in range(boards + 1)]
    planks = [box(width - 0.04, depth - 0.02, 0.025, (0.0, 0.0, z)) for z in levels]
    books: list[tuple[Mesh, int]] = []
    things: list[Part] = []
    for z in levels[:-1]:
        left, right, z = -width / 2 + 0.03, width / 2 - 0.03, z + 0.02
        if rng.random() < 0.3:
            right -= 0.3
            urn = [(0.05, 0.0), (0.1, 0.06), (0.1, 0.12), (0.04, 0.19), (0.06, 0.23), (0.05, 0.22)]
            things.append(Part(lathe(urn, 12, (right + 0.15, 0.0, z)), glazed(rng)))
        books += _row_of_books(rng, left, right, depth, z, room - 0.05)
    colours = [pick(rng, FABRICS + PAINTS, 0.1) for _ in range(8)]
    shown = [
        Part(join(mesh for mesh, index in books if index == i), solid(colour))
        for i, colour in enumerate(colours)
        if any(index == i for _, index in books)
    ]
    rear = box(width - 0.02, 0.015, height - 0.04, (0.0, -depth / 2 + 0.02, 0.02))
    return assemble(
        "shelf", Part(join([*sides, *planks]), frame), Part(rear, back), *shown, *things
    )


def coat_stand(rng: np.random.Generator, large: bool) -> Piece:
    """A pole with hooks and two coats, for halls."""
    pole = lathe(
        [(0.16, 0.0), (0.15, 0.02), (0.03, 0.05), (0.022, 1.2), (0.025, 1.75), (0.01, 1.8)]
    )
    hooks = [
        cylinder(0.012, 0.2, sides=6).turned("x", -1.0).turned("z", a).moved(0.0, 0.0, 1.6)
        for a in np.arange(6) * np.pi / 3
    ]
    coat = [(0.16, 0.55), (0.17, 0.6), (0.14, 1.1), (0.15, 1.4), (0.05, 1.62)]
    hung = lathe(coat, 10).scaled(1.0, 0.5, 1.0)
    around = rng.choice(np.arange(6) * np.pi / 3, 2, replace=False)
    coats = [
        Part(hung.moved(0.0, 0.16, 0.03 * i).turned("z", angle), solid(pick(rng, FABRICS)))
        for i, angle in enumerate(around)
    ]
    return assemble("coat_stand", Part(join([pole, *hooks]), wood(rng)), *coats)
