"""Rugs, pictures, mirrors, curtains, fireplaces and clocks."""

import numpy as np

from vlnhijack.scenes.procedural.art import painting
from vlnhijack.scenes.procedural.furniture.piece import Part, Piece, assemble
from vlnhijack.scenes.procedural.materials import (
    PAINTS,
    WOODS,
    Material,
    fabric,
    marble,
    metal,
    mix,
    pick,
    solid,
    spots,
    wood,
)
from vlnhijack.scenes.procedural.noise import Array
from vlnhijack.scenes.procedural.shapes import (
    Mesh,
    bar,
    box,
    cone,
    cylinder,
    join,
    lathe,
    loft,
    rectangle,
    taper,
)
from vlnhijack.scenes.procedural.surroundings import rug as rug_material


def rug(rng: np.random.Generator, large: bool) -> Piece:
    """A rectangular or round rug, 12 mm thick."""
    if rng.random() < 0.25:
        width = rng.uniform(1.2, 1.9)
        disc = lathe([(width / 2, 0.0), (width / 2 - 0.01, 0.012)], 32)
        return assemble("rug", Part(disc, rug_material(rng, width, width, True)))
    width, depth = rng.uniform(1.5, 2.3), rng.uniform(1.0, 1.5)
    sheet = taper((width, depth), (width - 0.02, depth - 0.02), 0.012)
    return assemble("rug", Part(sheet, rug_material(rng, width, depth, False)))


def _frame(width: float, height: float, edge: float) -> Mesh:
    """A bevelled frame, its back at y = 0, its bottom at z = 0, hollow in front."""
    sizes = [(0.0, 0.0), (0.0, 0.02), (edge * 0.5, 0.035), (edge, 0.022), (edge, 0.008)]
    rings = [rectangle(width - 2 * f, height - 2 * f, y) for f, y in sizes]
    return loft(rings).turned("x", -np.pi / 2).moved(0.0, 0.0, height / 2)


def picture(rng: np.random.Generator, large: bool) -> Piece:
    """A framed painting; its bottom at z = 0 and its back at the least y."""
    width = rng.uniform(0.9, 1.3) if large else rng.uniform(0.5, 1.0)
    height, edge = width * rng.uniform(0.65, 1.2), rng.uniform(0.04, 0.08)
    canvas = box(width - 1.8 * edge, 0.01, height - 1.8 * edge, (0.0, 0.008, 0.9 * edge))
    art = painting(rng, width - 1.8 * edge, height - 1.8 * edge, 0.9 * edge)
    gilt = metal(rng, (0.72, 0.55, 0.25)) if rng.random() < 0.4 else wood(rng, pick(rng, WOODS))
    return assemble("picture", Part(_frame(width, height, edge), gilt), Part(canvas, art))


def mirror(rng: np.random.Generator, large: bool) -> Piece:
    """A framed mirror that shows a pale room."""
    width, height = rng.uniform(0.5, 0.8), rng.uniform(0.7, 1.1)
    glass = box(width - 0.08, 0.01, height - 0.08, (0.0, 0.008, 0.04))
    slope = rng.uniform(0.3, 0.9)

    def sheen(points: Array, normals: Array) -> Array:
        bands = np.sin((points[:, 0] * slope + points[:, 2]) * 9) > 0.75
        return mix((0.62, 0.70, 0.75), (0.86, 0.9, 0.92), 0.4 * points[:, 2] / height + 0.6 * bands)

    return assemble("mirror", Part(_frame(width, height, 0.05), wood(rng)), Part(glass, sheen))


def curtain(rng: np.random.Generator, large: bool) -> Piece:
    """A pair of pleated curtains on a rod, for a wall; their bottom is on the floor."""
    width, height = rng.uniform(1.3, 2.0), rng.uniform(2.1, 2.35)
    half = width * rng.uniform(0.28, 0.5)
    drapes = [_drape(half, height).moved(side * (width - half) / 2, 0.0) for side in (-1, 1)]
    rod = bar((-width / 2 - 0.12, 0.0, height), (width / 2 + 0.12, 0.0, height), 0.016)
    return assemble("curtain", Part(join(drapes), fabric(rng)), Part(rod, metal(rng)))


def _drape(width: float, height: float) -> Mesh:
    x = np.linspace(-width / 2, width / 2, 25)
    wave = 0.04 * np.cos(np.arange(25) * np.pi / 2)
    section = np.array([(0.0, 0.0), (0.02, 0.0), (0.02, height), (0.0, height)])
    ring = np.broadcast_to(section, (25, 4, 2)) + np.stack([wave, 0 * wave], axis=-1)[:, None]
    return loft(np.concatenate([np.broadcast_to(x[:, None, None], (25, 4, 1)), ring], axis=-1))


def fireplace(rng: np.random.Generator, large: bool) -> Piece:
    """A mantelpiece round a dark hearth with logs."""
    width, height, depth = rng.uniform(1.3, 1.6), rng.uniform(1.05, 1.2), 0.34
    pillar = 0.24
    stone: Material = marble(rng) if rng.random() < 0.5 else solid(pick(rng, PAINTS))
    sides = [box(pillar, depth, height, (s * (width - pillar) / 2, 0.0, 0.0)) for s in (-1, 1)]
    lintel = box(width - 0.02, depth - 0.02, 0.28, (0.0, 0.0, height - 0.28))
    shelf = box(width + 0.16, depth + 0.12, 0.06, (0.0, 0.03, height - 0.02))
    hearth = box(width + 0.1, depth + 0.25, 0.05, (0.0, 0.1, -0.0))
    rear = box(width - 0.1, 0.05, height - 0.1, (0.0, -depth / 2 + 0.04, 0.02))
    logs = [
        cylinder(0.045, 0.5, sides=8).turned("y", np.pi / 2).moved(-0.25, y, z)
        for y, z in ((-0.03, 0.1), (0.07, 0.1), (0.02, 0.18))
    ]
    flames = [
        cone(0.05, 0.005, rng.uniform(0.18, 0.3), (x, 0.02, 0.2), 7) for x in (-0.12, 0.0, 0.12)
    ]
    return assemble(
        "fireplace",
        Part(join([*sides, lintel, shelf, hearth]), stone),
        Part(rear, spots(rng, (0.10, 0.08, 0.07), (0.22, 0.12, 0.09), 0.1)),
        Part(join(logs), wood(rng, (0.35, 0.22, 0.12), 0)),
        Part(join(flames), solid((0.93, 0.55, 0.12))),
    )
