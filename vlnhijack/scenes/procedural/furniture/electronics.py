"""Televisions and lamps."""

import numpy as np

from vlnhijack.scenes.procedural.art import view
from vlnhijack.scenes.procedural.furniture.piece import Part, Piece, assemble
from vlnhijack.scenes.procedural.furniture.seating import legs
from vlnhijack.scenes.procedural.furniture.storage import door, gaps
from vlnhijack.scenes.procedural.materials import (
    FABRICS,
    WOODS,
    Material,
    fabric,
    glazed,
    metal,
    mix,
    pick,
    shade,
    solid,
    wood,
)
from vlnhijack.scenes.procedural.noise import Array
from vlnhijack.scenes.procedural.shapes import bar, box, cushion, cylinder, join, lathe, taper


def tv_monitor(rng: np.random.Generator, large: bool) -> Piece:
    """A flat television on a foot, or, large, 1.3-1.5 m wide on a low cabinet."""
    width = rng.uniform(1.3, 1.5) if large else rng.uniform(0.55, 0.95)
    height = width * 0.57
    base = rng.uniform(0.45, 0.6) if large else 0.0
    lift = base + 0.07
    frame = metal(rng, (0.10, 0.10, 0.11) if rng.random() < 0.7 else (0.55, 0.55, 0.57))
    case = cushion(width, 0.05, height, 0.012, (0.0, 0.0, lift))
    bulge = box(width * 0.6, 0.05, height * 0.5, (0.0, -0.04, lift + height * 0.2))
    neck = box(0.08, 0.03, 0.15, (0.0, -0.02, base))
    foot = cushion(width * 0.45, 0.22, 0.02, 0.008, (0.0, 0.0, base - 0.002))
    edge = 0.028
    screen = box(width - 2 * edge, 0.01, height - 2 * edge, (0.0, 0.022, lift + edge))
    shown = _screen(rng, width - 2 * edge, height - 2 * edge, lift + edge)
    parts = [Part(join([case, bulge, neck, foot]), frame), Part(screen, shown)]
    if large:
        parts += _low_cabinet(rng, width + rng.uniform(0.1, 0.3), base)
    return assemble("tv_monitor", *parts)


def _screen(rng: np.random.Generator, width: float, height: float, bottom: float) -> Material:
    """A dark screen with the sheen of a window, or a picture."""
    picture, slope = view(rng, width, height, bottom), rng.uniform(-0.5, 0.5)
    off = rng.random() < 0.4

    def evaluate(points: Array, normals: Array) -> Array:
        if not off:
            return picture(points, normals)
        u, v = points[:, 0] / width, (points[:, 2] - bottom) / height
        sheen = np.clip(1 - np.abs(u - slope * v + 0.1) * 6, 0, 1) * 0.5
        return mix((0.06, 0.065, 0.08), (0.32, 0.36, 0.42), sheen + 0.25 * v)

    return evaluate


def _low_cabinet(rng: np.random.Generator, width: float, height: float) -> list[Part]:
    colour = pick(rng, WOODS)
    body = box(width, 0.4, height - 0.1, (0.0, 0.0, 0.1))
    doors = [
        door(width / 3 - 0.02, height - 0.16, (x * width / 3, 0.188, 0.13)) for x in (-1, 0, 1)
    ]
    knobs = [box(0.12, 0.03, 0.015, (x * width / 3, 0.215, height - 0.08)) for x in (-1, 0, 1)]
    return [
        gaps(width - 0.04, height - 0.15, 0.2, 0.125),
        Part(join([body, legs(width - 0.1, 0.36, 0.12, 0.05)]), wood(rng, colour, 0)),
        Part(join(doors), wood(rng, shade(colour, 1.12), 0)),
        Part(join(knobs), metal(rng)),
    ]


def lamp(rng: np.random.Generator, large: bool) -> Piece:
    """A floor lamp with a fabric shade, an arc lamp, or a tripod lamp."""
    kind = rng.integers(3)
    height = rng.uniform(1.4, 1.75)
    top, wide, tall = rng.uniform(0.1, 0.18), rng.uniform(0.2, 0.28), rng.uniform(0.24, 0.36)
    bright = shade(pick(rng, [(0.93, 0.88, 0.72), (0.92, 0.8, 0.55), (0.9, 0.55, 0.4)]), 1.0)
    stand = metal(rng) if rng.random() < 0.6 else wood(rng)
    hood = [(wide, 0.0), (top, tall), (top - 0.01, tall), (wide - 0.012, 0.02)]
    cover = fabric(rng, bright, "plain")
    if kind == 0:
        column = [(0.15, 0.0), (0.15, 0.02), (0.03, 0.05), (0.014, 0.1), (0.014, height - 0.1)]
        poles = lathe(column, 14)
    elif kind == 1:
        angles = np.arange(3) * 2 * np.pi / 3 + np.pi / 2
        poles = join(
            bar((0.28 * np.cos(a), 0.28 * np.sin(a), 0.0), (0, 0, height - tall + 0.02), 0.016, 7)
            for a in angles
        )
    else:
        turned = [
            (0.13, 0.0), (0.14, 0.03), (0.06, 0.07), (0.03, 0.3), (0.06, 0.45), (0.025, 0.6),
            (0.02, height - 0.1),
        ]  # fmt: skip
        poles = lathe(turned, 12)
    shell = lathe(hood, 20, (0.0, 0.0, height - tall))
    return assemble("lamp", Part(poles, stand), Part(shell, cover))


def table_lamp(rng: np.random.Generator, large: bool) -> Piece:
    """A ceramic foot under a fabric shade, for tables and nightstands."""
    foot = [(0.07, 0.0), (0.1, 0.06), (0.09, 0.14), (0.03, 0.22), (0.012, 0.3)]
    hood = [(0.16, 0.0), (0.1, 0.2), (0.09, 0.2), (0.15, 0.02)]
    return assemble(
        "table_lamp",
        Part(lathe(foot, 14), glazed(rng)),
        Part(lathe(hood, 18, (0.0, 0.0, 0.26)), fabric(rng, (0.92, 0.84, 0.64), "plain")),
    )


def piano(rng: np.random.Generator, large: bool) -> Piece:
    """An upright piano."""
    gloss = solid((0.07, 0.06, 0.06)) if rng.random() < 0.6 else wood(rng, (0.4, 0.2, 0.12))
    body = box(1.45, 0.34, 1.18, (0.0, -0.15, 0.02))
    lid = box(1.5, 0.4, 0.03, (0.0, -0.14, 1.19))
    bed = box(1.44, 0.36, 0.1, (0.0, 0.12, 0.58))
    cheeks = [box(0.07, 0.37, 0.18, (x, 0.12, 0.6)) for x in (-0.7, 0.7)]
    posts = [taper((0.06, 0.06), (0.09, 0.09), 0.62, (x, 0.24, 0.0)) for x in (-0.66, 0.66)]
    keys = box(1.3, 0.16, 0.02, (0.0, 0.2, 0.675))
    black = [
        box(0.024, 0.09, 0.02, (-0.6 + 0.0366 * i, 0.172, 0.69))
        for i in range(34)
        if i % 7 not in (2, 6)
    ]
    rest = box(0.7, 0.02, 0.2).turned("x", 0.25).moved(0.0, 0.06, 0.86)
    pedals = [cylinder(0.02, 0.02, (x, 0.05, 0.03), 8) for x in (-0.08, 0.0, 0.08)]
    return assemble(
        "piano",
        Part(join([body, lid, bed, *cheeks, *posts, rest]), gloss),
        Part(keys, solid((0.92, 0.91, 0.86))),
        Part(join(black), solid((0.06, 0.06, 0.06))),
        Part(join(pedals), metal(rng, (0.75, 0.6, 0.3))),
        Part(cushion(0.6, 0.3, 0.08, 0.03, (0.0, 0.62, 0.45)), fabric(rng, pick(rng, FABRICS))),
        Part(legs(0.54, 0.26, 0.47, 0.05).moved(0.0, 0.62), gloss),
    )
