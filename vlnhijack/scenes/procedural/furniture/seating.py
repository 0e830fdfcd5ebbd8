"""Chairs, armchairs, sofas, stools and benches."""

import numpy as np

from vlnhijack.scenes.procedural.furniture.piece import Part, Piece, assemble
from vlnhijack.scenes.procedural.materials import (
    FABRICS,
    PAINTS,
    WOODS,
    Material,
    fabric,
    leather,
    metal,
    pick,
    solid,
    wood,
)
from vlnhijack.scenes.procedural.shapes import (
    Mesh,
    Point,
    bar,
    box,
    cone,
    cushion,
    cylinder,
    join,
    lathe,
    sweep,
    taper,
)


def corners(width: float, depth: float, inset: float = 0.0) -> list[tuple[float, float]]:
    """The four corners (x, y) of a rectangle, drawn in by `inset`."""
    x, y = width / 2 - inset, depth / 2 - inset
    return [(-x, -y), (x, -y), (x, y), (-x, y)]


def legs(width: float, depth: float, height: float, thick: float, splay: float = 0.0) -> Mesh:
    """Four tapered legs of `thick` metres under a rectangle, leaning outwards by `splay`."""
    foot = (0.6 * thick, 0.6 * thick)
    return join(
        taper(
            foot,
            (thick, thick),
            height,
            (x + splay * np.sign(x), y + splay * np.sign(y), 0.0),
            (-splay * np.sign(x), -splay * np.sign(y)),
        )
        for x, y in corners(width, depth, thick / 2)
    )


def upholstery(rng: np.random.Generator) -> Material:
    """Fabric mostly, leather sometimes."""
    return leather(rng) if rng.random() < 0.25 else fabric(rng)


def chair(rng: np.random.Generator, large: bool) -> Piece:
    """A dining or office chair; large: an armchair."""
    if large:
        return _armchair(rng)
    return [_wooden_chair, _wooden_chair, _padded_chair, _office_chair][rng.integers(4)](rng)


def _wooden_chair(rng: np.random.Generator) -> Piece:
    width, depth = rng.uniform(0.42, 0.5), rng.uniform(0.42, 0.48)
    seat, top, thick = 0.46, rng.uniform(0.85, 1.05), rng.uniform(0.035, 0.05)
    frame = wood(rng) if rng.random() < 0.7 else solid(pick(rng, PAINTS))
    rear, tilt = -depth / 2 + thick / 2, rng.uniform(0.04, 0.09)
    posts = [
        bar((x, rear, seat - 0.1), (x, rear - tilt, top), 0.55 * thick, 6)
        for x in (-width / 2 + thick / 2, width / 2 - thick / 2)
    ]
    back: list[Mesh] = []
    inner = width - thick
    if rng.random() < 0.5:
        for z in np.linspace(seat + 0.14, top - 0.06, rng.integers(2, 5)):
            y = rear - tilt * (z - seat + 0.1) / (top - seat + 0.1)
            back.append(box(inner, 0.02, 0.06, (0.0, y, z - 0.03)))
    else:
        for x in np.linspace(-inner / 2, inner / 2, rng.integers(5, 8))[1:-1]:
            back.append(bar((x, rear, seat), (x, rear - tilt, top - 0.03), 0.011, 6))
        back.append(box(width, 0.025, 0.09, (0.0, rear - tilt, top - 0.08)))
    apron = box(width - 0.06, depth - 0.06, 0.06, (0.0, 0.0, seat - 0.07))
    wooden = join([legs(width, depth, seat - 0.013, thick), apron, *posts, *back])
    plate = cushion(width, depth, 0.035, 0.015, (0.0, 0.0, seat - 0.015))
    parts = [Part(wooden, frame), Part(plate, frame)]
    if rng.random() < 0.5:
        pad = cushion(width - 0.05, depth - 0.05, 0.05, 0.025, (0.0, 0.0, seat + 0.01))
        parts.append(Part(pad, fabric(rng)))
    return assemble("chair", *parts)


def _padded_chair(rng: np.random.Generator) -> Piece:
    width, depth, seat = rng.uniform(0.46, 0.54), rng.uniform(0.48, 0.54), 0.47
    cover = upholstery(rng)
    top = rng.uniform(0.88, 1.05)
    under = legs(width - 0.04, depth - 0.04, seat - 0.09, 0.045, 0.02)
    base = cushion(width, depth, 0.13, 0.05, (0.0, 0.0, seat - 0.11), 0.015)
    back = cushion(width, 0.1, top - seat + 0.1, 0.05).turned("x", 0.12)
    back = back.moved(0.0, -depth / 2 + 0.04, seat - 0.08)
    return assemble("chair", Part(under, wood(rng)), Part(join([base, back]), cover))


def _office_chair(rng: np.random.Generator) -> Piece:
    cover = solid(pick(rng, FABRICS)) if rng.random() < 0.5 else leather(rng)
    steel = metal(rng, (0.16, 0.16, 0.17))
    star, wheels = [], []
    for a in np.arange(5) * 2 * np.pi / 5 + np.pi / 2:
        x, y = 0.3 * np.cos(a), 0.3 * np.sin(a)
        star.append(bar((0.0, 0.0, 0.12), (x, y, 0.08), 0.022, 6))
        wheels.append(cylinder(0.035, 0.05, (x, y, 0.0), 8))
    column = cylinder(0.03, 0.36, (0.0, 0.0, 0.09), 10)
    seat = cushion(0.5, 0.5, 0.09, 0.04, (0.0, 0.0, 0.43), 0.01)
    back = cushion(0.46, 0.08, rng.uniform(0.5, 0.68), 0.04).turned("x", 0.12)
    arms = []
    for side in (-0.27, 0.27):
        path = [(side * 0.85, 0.0, 0.46), (side, 0.0, 0.5), (side, 0.0, 0.66)]
        arms += [sweep(path, 0.018, 6), cushion(0.06, 0.28, 0.035, 0.015, (side, 0.02, 0.65))]
    stay = bar((0.0, -0.2, 0.45), (0.0, -0.3, 0.75), 0.025, 6)
    return assemble(
        "chair",
        Part(join([*star, column, stay, *wheels]), steel),
        Part(join(arms), steel),
        Part(join([seat, back.moved(0.0, -0.24, 0.56)]), cover),
    )


def _seat_frame(
    rng: np.random.Generator, width: float, depth: float, height: float, seats: int, chaise: bool
) -> list[Part]:
    """What an armchair and a sofa share: legs, base, arms, back and loose cushions."""
    cover, arm, foot = upholstery(rng), rng.uniform(0.13, 0.22), rng.uniform(0.06, 0.14)
    level, thick = 0.44, rng.uniform(0.16, 0.22)
    arm_height = rng.uniform(0.56, 0.66)
    base = cushion(width - 0.04, depth - 0.06, level - foot - 0.1, 0.04, (0.0, 0.0, foot))
    back = cushion(width - 0.06, 0.2, height - foot - 0.06, 0.09, (0.0, -depth / 2 + 0.13, foot))
    soft = [base, back.turned("x", 0.05, (0.0, -depth / 2, foot))]
    for side in (-1, 1):
        at = (side * (width - arm) / 2, 0.0, foot - 0.02)
        soft.append(cushion(arm, depth, arm_height - foot, rng.uniform(0.04, 0.07), at))
    room = (width - 2 * arm) / seats
    loose: list[Mesh] = []
    for i in range(seats):
        x = -width / 2 + arm + room * (i + 0.5)
        long = 0.55 if chaise and i == 0 else 0.0
        seat_depth, y = depth - 0.2 + long, 0.11 + long / 2
        loose.append(cushion(room + 0.01, seat_depth, thick, 0.06, (x, y, level - 0.13), 0.02))
        rest = cushion(room - 0.01, thick, height - level, 0.08).turned("x", 0.18)
        loose.append(rest.moved(x, -depth / 2 + 0.31, level))
        if long:
            pad = cushion(room, 0.9, level - foot - 0.1, 0.04, (x, depth / 2 + 0.08, foot - 0.01))
            soft.append(pad)
            soft.append(box(0.05, 0.05, foot + 0.05, (x - 0.2, depth / 2 + long - 0.1, 0.0)))
    feet = legs(width - 0.1, depth - 0.1, foot + 0.03, 0.06, 0.01)
    loose_cover = upholstery(rng) if rng.random() < 0.2 else cover
    return [Part(feet, wood(rng)), Part(join(soft), cover), Part(join(loose), loose_cover)]


def _pillow(rng: np.random.Generator, at: Point) -> Part:
    size = rng.uniform(0.36, 0.46)
    shape = cushion(size, 0.14, size, 0.069).turned("y", rng.uniform(-0.3, 0.3))
    return Part(shape.turned("x", 0.35).moved(*at), fabric(rng))


def _armchair(rng: np.random.Generator) -> Piece:
    width, depth = rng.uniform(0.95, 1.1), rng.uniform(0.88, 1.0)
    height = rng.uniform(0.92, 1.2)
    parts = _seat_frame(rng, width, depth, height, 1, False)
    if height > 1.0:
        wings = [
            cushion(0.09, 0.34, height - 0.55, 0.04, (side * (width / 2 - 0.07), -depth / 4, 0.5))
            for side in (-1, 1)
        ]
        parts.append(Part(join(wings), parts[1].material))
    elif rng.random() < 0.6:
        parts.append(_pillow(rng, (0.0, -depth / 2 + 0.5, 0.52)))
    return assemble("chair", *parts)


def sofa(rng: np.random.Generator, large: bool) -> Piece:
    """Two to four seats with cushions; some have a chaise longue."""
    seats = int(rng.integers(3, 5)) if large else int(rng.integers(2, 4))
    width, depth = seats * rng.uniform(0.62, 0.7) + 0.3, rng.uniform(0.86, 1.0)
    height = rng.uniform(0.82, 0.98)
    parts = _seat_frame(rng, width, depth, height, seats, bool(large and rng.random() < 0.5))
    for i, x in enumerate(rng.permutation([-0.36, 0.36, 0.22, -0.2])[: rng.integers(0, 4)]):
        parts.append(_pillow(rng, (float(x * width), -depth / 2 + 0.46 + 0.03 * i, 0.5)))
    return assemble("sofa", *parts)


def stool(rng: np.random.Generator, large: bool) -> Piece:
    """A bar stool, a three-legged stool or a pouffe."""
    radius = rng.uniform(0.17, 0.21)
    kind = rng.integers(3)
    if kind == 0:
        height = 0.42
        body = lathe(
            [(0.24, 0.0), (0.29, 0.07), (0.3, 0.2), (0.29, 0.34), (0.24, height), (0.1, 0.44)], 18
        )
        return assemble("stool", Part(body, upholstery(rng)))
    height = 0.47 if kind == 1 else 0.74
    spread = 0.8 * radius + 0.06
    angles = np.arange(4) * np.pi / 2 + np.pi / 4
    feet = [(1.25 * spread * np.cos(a), 1.25 * spread * np.sin(a), 0.0) for a in angles]
    tops = [(0.6 * radius * np.cos(a), 0.6 * radius * np.sin(a), height - 0.02) for a in angles]
    posts = [bar(f, t, 0.018, 8) for f, t in zip(feet, tops, strict=True)]
    middle = 0.6 * np.array(feet) + 0.4 * np.array(tops)
    rungs = [sweep(middle[[i, (i + 1) % 4]], 0.011, 6) for i in range(4)]
    plate = cone(radius, radius, 0.04, (0.0, 0.0, height - 0.03), 20)
    frame = wood(rng) if rng.random() < 0.6 else metal(rng)
    parts = [Part(join([*posts, *rungs]), frame), Part(plate, wood(rng))]
    if rng.random() < 0.5:
        pad = [(radius, 0.0), (radius + 0.01, 0.03), (0.8 * radius, 0.06), (0.3 * radius, 0.065)]
        parts.append(Part(lathe(pad, 20, (0.0, 0.0, height)), upholstery(rng)))
    return assemble("stool", *parts)


def bench(rng: np.random.Generator, large: bool) -> Piece:
    """A hall bench: a wooden seat on legs with a cushion."""
    width, depth = rng.uniform(1.0, 1.4), rng.uniform(0.36, 0.44)
    timber = wood(rng, pick(rng, WOODS), 0)
    rail = box(width - 0.12, 0.03, 0.08, (0.0, 0.0, 0.14))
    parts = [
        Part(join([legs(width, depth, 0.42, 0.06), rail]), timber),
        Part(cushion(width, depth, 0.04, 0.015, (0.0, 0.0, 0.41)), timber),
        Part(cushion(width - 0.06, depth - 0.04, 0.08, 0.035, (0.0, 0.0, 0.44)), fabric(rng)),
    ]
    return assemble("bench", *parts)
