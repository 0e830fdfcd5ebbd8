"""Toilets, bathtubs, washbasins and washing machines."""

import numpy as np

from vlnhijack.scenes.procedural.furniture.kitchen import STEEL, tap
from vlnhijack.scenes.procedural.furniture.piece import Part, Piece, assemble
from vlnhijack.scenes.procedural.materials import ceramic, metal, pick, solid, wood
from vlnhijack.scenes.procedural.shapes import (
    Mesh,
    Point,
    box,
    circle,
    cushion,
    cylinder,
    join,
    lathe,
    loft,
    rectangle,
    shell,
)


def _ovals(sizes: list[tuple[float, float, float, float]], cyclic: bool = False) -> Mesh:
    """A skin over ovals of (width, depth, y, z), from the bottom up."""
    unit = circle(0.5, 0.0, 18)
    return loft([unit * (w, d, 1.0) + np.array([0.0, y, z]) for w, d, y, z in sizes], cyclic)


def toilet(rng: np.random.Generator, large: bool) -> Piece:
    """A close-coupled toilet, its lid open or shut."""
    bowl = _ovals(
        [
            (0.26, 0.42, 0.02, 0.0),
            (0.22, 0.36, 0.02, 0.12),
            (0.30, 0.44, 0.05, 0.26),
            (0.38, 0.5, 0.07, 0.38),
            (0.38, 0.5, 0.07, 0.4),
            (0.27, 0.36, 0.08, 0.4),
            (0.16, 0.2, 0.07, 0.27),
        ]
    )
    cistern = cushion(0.4, 0.18, 0.4, 0.03, (0.0, -0.26, 0.38))
    cover = cushion(0.43, 0.21, 0.04, 0.015, (0.0, -0.26, 0.77))
    neck = box(0.2, 0.2, 0.36, (0.0, -0.2, 0.02))
    seat = _ovals(
        [
            (0.4, 0.52, 0.07, 0.395),
            (0.4, 0.52, 0.07, 0.42),
            (0.26, 0.34, 0.08, 0.42),
            (0.27, 0.35, 0.08, 0.395),
        ],
        cyclic=True,
    )
    lid = _ovals([(0.4, 0.48, 0.0, 0.0), (0.4, 0.48, 0.0, 0.02), (0.3, 0.38, 0.0, 0.028)])
    open_lid = lid.turned("x", np.pi / 2 + 0.15).moved(0.0, -0.12, 0.66)
    shut = lid.moved(0.0, 0.07, 0.425)
    button = cylinder(0.025, 0.02, (0.0, -0.26, 0.8), 10)
    plastic = solid(pick(rng, [(0.9, 0.9, 0.88), (0.45, 0.28, 0.16), (0.2, 0.2, 0.22)], 0.02))
    return assemble(
        "toilet",
        Part(join([bowl, cistern, cover, neck]), ceramic(rng)),
        Part(join([seat, open_lid if rng.random() < 0.6 else shut]), plastic),
        Part(button, metal(rng, STEEL)),
    )


def bathtub(rng: np.random.Generator, large: bool) -> Piece:
    """A built-in or a free-standing tub with a tap, filled or empty."""
    length, width, height = rng.uniform(1.5, 1.75), rng.uniform(0.7, 0.8), rng.uniform(0.54, 0.6)
    if rng.random() < 0.5:
        outline = rectangle(length, width, 0.0, 0.06)
        tub = shell(outline, 0.16, height, 0.07)
    else:
        outline = circle(0.5, 0.0, 24) * (length, width, 1.0)
        tub = loft(
            [
                outline * (0.75, 0.7, 1.0) + (0.0, 0.0, 0.06),
                outline * (0.88, 0.86, 1.0) + (0.0, 0.0, 0.25),
                outline * (0.97, 0.96, 1.0) + (0.0, 0.0, height - 0.04),
                outline * (1.02, 1.04, 1.0) + (0.0, 0.0, height),
                outline * (0.93, 0.88, 1.0) + (0.0, 0.0, height),
                outline * (0.78, 0.7, 1.0) + (0.0, 0.0, 0.16),
            ]
        )
    parts = [Part(tub, ceramic(rng))]
    if rng.random() < 0.5:
        level = outline * (0.83, 0.78, 1.0)
        water = loft([level + (0.0, 0.0, 0.12), level + (0.0, 0.0, height - 0.14)])
        parts.append(Part(water, solid((0.45, 0.72, 0.78))))
    feet = [
        lathe([(0.03, 0.0), (0.045, 0.05), (0.03, 0.14)], 8, (x, y, 0.0))
        for x in (-length / 4, length / 4)
        for y in (-width / 5, width / 5)
    ]
    fittings = tap(0.25, 0.16, (0.0, 0.0, 0.0)).turned("z", -np.pi / 2)
    at = (-length / 2 + 0.03, 0.0, height)
    parts.append(Part(join([*feet, fittings.moved(*at)]), metal(rng)))
    return assemble("bathtub", *parts)


def washbasin(rng: np.random.Generator, large: bool) -> Piece:
    """A basin on a pedestal or on a vanity unit, with a tap."""
    bowl = _ovals(
        [
            (0.24, 0.2, -0.02, 0.68),
            (0.5, 0.4, 0.0, 0.78),
            (0.58, 0.46, 0.0, 0.85),
            (0.58, 0.46, 0.0, 0.87),
            (0.48, 0.34, 0.03, 0.87),
            (0.3, 0.22, 0.02, 0.77),
        ]
    )
    ledge = cushion(0.44, 0.12, 0.06, 0.02, (0.0, -0.19, 0.815))
    parts = [Part(tap(0.16, 0.12, (0.0, -0.19, 0.875)), metal(rng, STEEL))]
    if rng.random() < 0.5:
        foot = lathe([(0.13, 0.0), (0.1, 0.05), (0.08, 0.4), (0.11, 0.75)], 14)
        parts.append(Part(join([bowl, ledge, foot]), ceramic(rng)))
    else:
        timber = wood(rng)
        unit = box(0.52, 0.4, 0.62, (0.0, -0.02, 0.12))
        doors = [box(0.24, 0.03, 0.52, (x, 0.185, 0.17)) for x in (-0.13, 0.13)]
        posts = [box(0.04, 0.04, 0.14, (x, y, 0.0)) for x in (-0.22, 0.22) for y in (-0.18, 0.14)]
        knobs = [cylinder(0.015, 0.03, (x, 0.2, 0.5), 8) for x in (-0.04, 0.04)]
        parts += [
            Part(join([bowl, ledge]), ceramic(rng)),
            Part(join([unit, *doors, *posts]), timber),
            Part(join(knobs), metal(rng, STEEL)),
        ]
    return assemble("washbasin", *parts)


def washing_machine(rng: np.random.Generator, large: bool) -> Piece:
    """A front-loader with a round door, a drawer and a dial."""
    front = 0.29

    def disc(profile: list[tuple[float, float]], at: Point) -> Mesh:
        return lathe(profile, 20).turned("x", -np.pi / 2).moved(*at)

    body = cushion(0.6, 0.58, 0.84, 0.015, (0.0, 0.0, 0.02))
    ring = disc([(0.2, 0.0), (0.2, 0.035), (0.15, 0.045), (0.14, 0.02)], (0.0, front - 0.01, 0.42))
    glass = disc([(0.16, 0.0), (0.14, 0.03), (0.06, 0.04)], (0.0, front - 0.01, 0.42))
    dial = disc([(0.035, 0.0), (0.03, 0.03)], (0.08, front - 0.005, 0.77))
    panel = box(0.24, 0.01, 0.06, (-0.15, front, 0.74))
    feet = [cylinder(0.03, 0.04, (x, y, 0.0), 8) for x in (-0.24, 0.24) for y in (-0.22, 0.22)]
    return assemble(
        "washing_machine",
        Part(body, solid(pick(rng, [(0.9, 0.9, 0.89), (0.5, 0.52, 0.55)], 0.02))),
        Part(join([ring, dial]), metal(rng, STEEL)),
        Part(join([glass, panel, *feet]), solid((0.12, 0.14, 0.18))),
    )
