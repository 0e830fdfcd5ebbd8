"""Solid textures of rooms: walls, floors, ceilings and rugs; see `materials` for what they are."""

import numpy as np
from numpy.typing import NDArray

from vlnhijack.scenes.procedural.materials import (
    FABRICS,
    PAINTS,
    WOODS,
    Colour,
    Material,
    legal,
    mix,
    pick,
    seed_from,
    shade,
)
from vlnhijack.scenes.procedural.noise import fractal, hashed, noise

Array = NDArray[np.float64]

WALLS: tuple[Colour, ...] = (
    (0.90, 0.88, 0.83), (0.80, 0.84, 0.82), (0.86, 0.80, 0.68), (0.68, 0.75, 0.80),
    (0.84, 0.72, 0.66), (0.72, 0.77, 0.66), (0.76, 0.74, 0.76), (0.88, 0.82, 0.58),
)  # fmt: skip


def _unrolled(points: Array) -> Array:
    """(K,2) coordinates along and up axis-aligned walls."""
    return np.stack([points[:, 0] + points[:, 1], points[:, 2]], axis=-1)


def plaster(rng: np.random.Generator, colour: Colour | None = None) -> Material:
    """Painted plaster with faint stains."""
    base, seed = np.array(colour or pick(rng, WALLS, 0.04)), seed_from(rng)

    def evaluate(points: Array, normals: Array) -> Array:
        return legal(base * (0.94 + 0.1 * fractal(points, 0.8, seed, 4))[:, None])

    return evaluate


def wallpaper(rng: np.random.Generator, colour: Colour | None = None) -> Material:
    """Stripes, lozenges or flowers on a light ground."""
    base, seed = np.array(colour or pick(rng, WALLS, 0.05)), seed_from(rng)
    other = mix(base, pick(rng, FABRICS), np.array([rng.uniform(0.3, 0.7)]))[0]
    kind, scale = rng.integers(3), rng.uniform(0.16, 0.35)

    def evaluate(points: Array, normals: Array) -> Array:
        u, v = _unrolled(points).T / scale
        if kind == 0:
            amount = (np.mod(u, 1) < 0.5).astype(float)
        elif kind == 1:
            amount = (np.abs(np.mod(u, 1) - 0.5) + np.abs(np.mod(v / 1.4, 1) - 0.5) < 0.3) * 1.0
        else:
            row = np.floor(v)
            x, y = np.mod(u + row / 2, 1) - 0.5, np.mod(v, 1) - 0.5
            petals = 0.22 + 0.1 * np.cos(5 * np.arctan2(y, x))
            amount = (np.hypot(x, y) < petals).astype(float)
        return legal(mix(base, other, amount) * (0.96 + 0.06 * noise(points, 0.3, seed))[:, None])

    return evaluate


def wainscot(rng: np.random.Generator, height: float = 0.9) -> Material:
    """Panelled wood or painted boards up to `height` metres, plaster above."""
    lower, upper = pick(rng, PAINTS + WOODS[:3]), pick(rng, WALLS, 0.04)

    def evaluate(points: Array, normals: Array) -> Array:
        u, z = _unrolled(points).T
        groove = (np.mod(u, 0.2) < 0.02) | (np.abs(z - height) < 0.03) | (z < 0.1)
        boards = mix(lower, shade(lower, 0.7), groove * 1.0)
        return legal(np.where((z < height + 0.03)[:, None], boards, upper))

    return evaluate


def parquet(rng: np.random.Generator, colour: Colour | None = None) -> Material:
    """A floor of boards or of blocks in a basket weave, in the plane z = const."""
    base, seed = np.array(colour or pick(rng, WOODS[:7], 0.03)), seed_from(rng)
    width, blocks = rng.uniform(0.10, 0.18), rng.random() < 0.4

    def evaluate(points: Array, normals: Array) -> Array:
        x, y = points[:, 0], points[:, 1]
        if blocks:
            block = 4 * width
            flip = np.mod(np.floor(x / block) + np.floor(y / block), 2) > 0.5
            x, y = np.where(flip, y, x), np.where(flip, x, y)
            length = block
        else:
            length = 1.4
        row = np.floor(y / width)
        along = x / length + (0 if blocks else hashed(row[:, None].astype(np.int64), seed))
        board = np.stack([row, np.floor(along)], axis=-1).astype(np.int64)
        seam = (np.mod(y / width, 1) < 0.07) | (np.mod(along, 1) < 0.01)
        grain = noise(np.stack([x, y], axis=-1), np.array([0.5, 0.02]), seed + 1)
        tone = 0.75 + 0.3 * hashed(board, seed + 2) + 0.15 * grain
        return legal(base * (tone * np.where(seam, 0.6, 1.0))[:, None])

    return evaluate


def tile(rng: np.random.Generator, colour: Colour | None = None, wall: bool = False) -> Material:
    """Square tiles with grout: plain, chequered or mottled; on walls or on a floor."""
    base = np.array(colour or pick(rng, WALLS + PAINTS, 0.05))
    other = np.array(pick(rng, PAINTS + FABRICS))
    kind, seed = rng.integers(3), seed_from(rng)
    edge = rng.uniform(0.12, 0.2) if wall else rng.uniform(0.25, 0.45)

    def evaluate(points: Array, normals: Array) -> Array:
        plane = _unrolled(points) if wall else points[:, :2]
        cells, inside = np.floor(plane / edge).astype(np.int64), np.mod(plane / edge, 1)
        chequer = np.mod(cells.sum(axis=1), 2).astype(float)
        lively = hashed(cells, seed)
        amount = (0.15 * lively, chequer, 0.6 * (lively > 0.8))[kind]
        colours = mix(base, other, amount) * (0.92 + 0.1 * lively)[:, None]
        grout = inside.min(axis=1, keepdims=True) < 0.05
        return legal(np.where(grout, 0.62, colours))

    return evaluate


def carpet(rng: np.random.Generator, colour: Colour | None = None) -> Material:
    """Wall-to-wall carpet: short pile in one colour."""
    base, seed = np.array(colour or pick(rng, FABRICS, 0.05)), seed_from(rng)

    def evaluate(points: Array, normals: Array) -> Array:
        pile = 0.8 + 0.2 * noise(points, 0.02, seed) + 0.15 * fractal(points, 0.5, seed + 2, 2)
        return legal(base * pile[:, None])

    return evaluate


def rug(rng: np.random.Generator, width: float, depth: float, disc: bool) -> Material:
    """A bordered rug centred at the origin: oriental, bands or rings."""
    colours = np.array([pick(rng, FABRICS) for _ in range(4)])
    kind, seed, scale = rng.integers(3), seed_from(rng), rng.uniform(0.25, 0.4)

    def evaluate(points: Array, normals: Array) -> Array:
        x, y = points[:, 0], points[:, 1]
        if disc:
            edge = width / 2 - np.hypot(x, y)
        else:
            edge = np.minimum(width / 2 - np.abs(x), depth / 2 - np.abs(y))
        index = np.full(len(points), 0)
        if kind == 0:
            lozenge = np.abs(np.mod(x / scale, 1) - 0.5) + np.abs(np.mod(y / scale, 1) - 0.5)
            index[lozenge < 0.35], index[lozenge < 0.15] = 1, 2
            index[np.abs(x) / width + np.abs(y) / depth < 0.22] = 3
        elif kind == 1:
            index = np.mod(np.floor((x + 0.03 * np.sin(y * 40)) / (scale / 2)), 3).astype(int)
        else:
            index = np.mod(np.floor(edge / (scale / 2.5)), 4).astype(int)
        index = np.where((edge > 0.06) & (edge < 0.16), 2, np.where(edge <= 0.06, 3, index))
        return legal(colours[index] * (0.85 + 0.2 * noise(points, 0.02, seed))[:, None])

    return evaluate
