"""Fridges, stoves, kitchen sinks and counters."""

import numpy as np

from vlnhijack.scenes.procedural.furniture.piece import Part, Piece, assemble
from vlnhijack.scenes.procedural.furniture.storage import door, gaps
from vlnhijack.scenes.procedural.materials import (
    PAINTS,
    WOODS,
    Material,
    glazed,
    marble,
    metal,
    pick,
    solid,
    speckled,
    wood,
)
from vlnhijack.scenes.procedural.shapes import (
    Mesh,
    box,
    cushion,
    cylinder,
    join,
    lathe,
    loft,
    rectangle,
    sweep,
)

STEEL = (0.62, 0.63, 0.65)


def fridge(rng: np.random.Generator, large: bool) -> Piece:
    """A fridge-freezer with one or two doors, notes and magnets on it."""
    width, depth = rng.uniform(0.6, 0.75), rng.uniform(0.6, 0.68)
    height = rng.uniform(1.55, 1.85)
    coat = pick(rng, [(0.9, 0.9, 0.89), STEEL, (0.55, 0.75, 0.74), (0.72, 0.2, 0.18)], 0.02)
    skin = metal(rng, coat) if rng.random() < 0.5 else solid(coat)
    split = height * rng.uniform(0.32, 0.42) if rng.random() < 0.6 else height * 0.66
    front = depth / 2
    body = box(width, depth - 0.06, height - 0.04, (0.0, -0.03, 0.04))
    foot = box(width - 0.06, depth - 0.14, 0.05)
    leaves = [
        cushion(width, 0.08, split - 0.06, 0.02, (0.0, front - 0.02, 0.05)),
        cushion(width, 0.08, height - split - 0.01, 0.02, (0.0, front - 0.02, split + 0.005)),
    ]
    side = (width / 2 - 0.06) * rng.choice([-1, 1])
    grips = []
    for z, tall in ((split - 0.42, 0.32), (split + 0.08, 0.4)):
        path = [(side, front, z), (side, front + 0.06, z + 0.03),
                (side, front + 0.06, z + tall - 0.03), (side, front, z + tall)]  # fmt: skip
        grips.append(sweep(path, 0.012, 6))
    notes = [
        Part(
            box(0.09, 0.01, 0.11, (rng.uniform(-0.2, 0.2), front + 0.021 + 0.002 * i, z)),
            solid(pick(rng, [(0.92, 0.85, 0.35), (0.9, 0.5, 0.55), (0.5, 0.75, 0.9)])),
        )
        for i, z in enumerate(rng.uniform(split + 0.2, height - 0.25, rng.integers(0, 4)))
    ]
    return assemble(
        "fridge",
        Part(join([body, *leaves]), skin),
        Part(join([foot]), solid((0.12, 0.12, 0.12))),
        Part(join(grips), metal(rng)),
        *notes,
    )


def stove(rng: np.random.Generator, large: bool) -> Piece:
    """A cooker: oven door with a window, knobs, four burners and a pot."""
    width, depth, height = 0.6, 0.6, 0.9
    front = depth / 2
    coat = metal(rng, STEEL) if rng.random() < 0.5 else solid(pick(rng, PAINTS))
    dark = solid((0.07, 0.07, 0.08))
    body = box(width, depth, height - 0.01)
    splash = box(width - 0.01, 0.04, 0.14, (0.0, -front + 0.025, height - 0.02))
    hob = box(width - 0.03, depth - 0.06, 0.02, (0.0, 0.01, height - 0.015))
    oven = cushion(width - 0.05, 0.04, 0.48, 0.015, (0.0, front, 0.22))
    drawer = cushion(width - 0.05, 0.04, 0.14, 0.012, (0.0, front, 0.05))
    window = box(width - 0.2, 0.02, 0.24, (0.0, front + 0.015, 0.32))
    rod = [(-0.22, front, 0.66), (-0.22, front + 0.06, 0.66), (0.22, front + 0.06, 0.66),
           (0.22, front, 0.66)]  # fmt: skip
    knobs = [
        cylinder(0.024, 0.04, sides=10).turned("x", -np.pi / 2).moved(x, front - 0.005, 0.79)
        for x in np.linspace(-0.22, 0.22, 5)
    ]
    places = [(x, y) for x in (-0.14, 0.14) for y in (-0.12, 0.15)]
    rings = [lathe([(0.1, 0), (0.1, 0.02), (0.07, 0.02)], 14, (x, y, height)) for x, y in places]
    x, y = places[int(rng.integers(4))]
    pan = [(0.09, 0.0), (0.11, 0.015), (0.11, 0.13), (0.1, 0.13), (0.1, 0.03)]
    pot = lathe(pan, 14, (x, y, height + 0.016))
    grip = box(0.3, 0.025, 0.015, (x, y, height + 0.12))
    return assemble(
        "stove",
        Part(join([body, splash, oven, drawer]), coat),
        Part(join([hob, window]), dark),
        Part(join(rings), solid((0.16, 0.15, 0.15))),
        Part(join([sweep(rod, 0.012, 6), *knobs]), metal(rng, STEEL)),
        Part(join([pot, grip]), glazed(rng) if rng.random() < 0.5 else metal(rng, STEEL)),
    )


def tap(height: float, reach: float, at: tuple[float, float, float]) -> Mesh:
    """A swan-necked tap at `at` that leans towards +y."""
    bend = [
        (0.0, reach / 2 * (1 - np.cos(a)), height - reach / 2 + reach / 2 * np.sin(a))
        for a in np.linspace(0, np.pi, 7)
    ]
    neck = sweep([(0.0, 0.0, -0.02), *bend, (0.0, reach, height - reach / 2 - 0.05)], 0.014, 7)
    levers = [cylinder(0.018, 0.06, (x, 0.0, -0.01), 8) for x in (-0.07, 0.07)]
    return join([neck, *levers]).moved(*at)


def worktop_material(rng: np.random.Generator) -> Material:
    return [marble, speckled, lambda r: wood(r, axis=0)][rng.integers(3)](rng)


def counter(rng: np.random.Generator, large: bool) -> Piece:
    """Kitchen base units under a worktop, with jars."""
    width = rng.uniform(1.2, 2.0)
    parts, _ = _units(rng, width)
    top = box(width + 0.02, 0.63, 0.04, (0.0, 0.005, 0.87))
    jars = [
        lathe([(0.05, 0.0), (0.06, 0.02), (0.06, 0.14), (0.04, 0.17), (0.015, 0.2)], 10,
              (-width / 3 + 0.15 * i, -0.15, 0.905))
        for i in range(3)
    ]  # fmt: skip
    return assemble(
        "counter", *parts, Part(top, worktop_material(rng)), Part(join(jars), glazed(rng))
    )


def _units(rng: np.random.Generator, width: float) -> tuple[list[Part], float]:
    colour = pick(rng, PAINTS + WOODS[:4])
    front = 0.3
    doors = int(np.round(width / 0.45))
    each = width / doors
    fronts, grips = [], []
    for i in range(doors):
        x = -width / 2 + each * (i + 0.5)
        fronts.append(door(each - 0.018, 0.55, (x, front - 0.012, 0.12)))
        fronts.append(door(each - 0.018, 0.17, (x, front - 0.012, 0.685)))
        grips += [box(0.14, 0.035, 0.018, (x, front + 0.014, z)) for z in (0.62, 0.77)]
    body = box(width, 0.6, 0.79, (0.0, 0.0, 0.09))
    foot = box(width - 0.04, 0.5, 0.1, (0.0, -0.03, 0.0))
    parts = [
        gaps(width - 0.01, 0.755, front, 0.11),
        Part(body, solid(colour)),
        Part(foot, solid((0.15, 0.14, 0.14))),
        Part(join(fronts), solid(colour)),
        Part(join(grips), metal(rng)),
    ]
    return parts, front


def sink(rng: np.random.Generator, large: bool) -> Piece:
    """A kitchen sink: base units, a steel basin let into the worktop, and a tap."""
    width = rng.uniform(0.9, 1.4)
    parts, _ = _units(rng, width)
    outer = rectangle(width + 0.02, 0.63, 0.0)
    hole = rectangle(0.5, 0.36, 0.04)
    up = np.array([0.0, 0.0, 1.0])
    top = loft([outer, outer + 0.04 * up, hole, hole * (0.99, 0.99, 1.0) - 0.02 * up])
    basin = loft(
        [
            rectangle(0.53, 0.39, 0.02, 0.05),
            rectangle(0.53, 0.39, 0.05, 0.05),
            rectangle(0.49, 0.35, 0.05, 0.05),
            rectangle(0.46, 0.32, 0.022, 0.05),
        ]
    )
    return assemble(
        "sink",
        *parts,
        Part(top.moved(0.0, 0.005, 0.87), worktop_material(rng)),
        Part(basin.moved(0.0, 0.005, 0.87), metal(rng, (0.5, 0.51, 0.53))),
        Part(tap(0.3, 0.2, (0.0, -0.23, 0.91)), metal(rng, STEEL)),
    )
