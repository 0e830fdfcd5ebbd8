"""Painted images as materials in the plane of x and z, seen from +y."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from vlnhijack.scenes.procedural.materials import FABRICS, FLOWERS, PAINTS, Material, mix, pick
from vlnhijack.scenes.procedural.noise import fractal, noise

Array = NDArray[np.float64]
Drawing = Callable[[Array], Array]


def painting(
    rng: np.random.Generator, width: float, height: float, bottom: float = 0.0
) -> Material:
    """A landscape, seascape, flowers or an abstract on |x| ≤ width/2, z from `bottom` upwards."""
    makers = [_landscape, _sea, _blocks, _flowers, _rings]
    return _framed(makers[rng.integers(5)](rng), width, height, bottom)


def view(rng: np.random.Generator, width: float, height: float, bottom: float) -> Material:
    """A landscape or seascape, as televisions show it."""
    return _framed([_landscape, _sea][rng.integers(2)](rng), width, height, bottom)


def _framed(draw: Drawing, width: float, height: float, bottom: float) -> Material:
    def evaluate(points: Array, normals: Array) -> Array:
        u = 0.5 - points[:, 0] / width
        v = (points[:, 2] - bottom) / height
        return np.clip(draw(np.stack([u, v], axis=-1)), 0.04, 0.93)

    return evaluate


def _landscape(rng: np.random.Generator) -> Drawing:
    sky, low = (
        pick(rng, [(0.35, 0.6, 0.86), (0.9, 0.55, 0.3), (0.6, 0.72, 0.85)]),
        (0.92, 0.86, 0.7),
    )
    seed, sun = int(rng.integers(2**31)), rng.uniform(0.15, 0.85)

    def draw(p: Array) -> Array:
        u, v = p.T
        image = mix(low, sky, (v - 0.4) * 1.7)
        image[np.hypot(u - sun, v - 0.78) < 0.08] = (0.93, 0.88, 0.55)
        for layer, colour in enumerate([(0.45, 0.5, 0.62), (0.3, 0.42, 0.36), (0.33, 0.5, 0.18)]):
            line = np.stack([u, np.full_like(u, layer)], axis=-1)
            ridge = 0.62 - 0.2 * layer + 0.35 * (fractal(line, 0.4, seed + 9 * layer, 3) - 0.5)
            image[v < ridge] = colour
        return image * (0.9 + 0.2 * noise(p, 0.04, seed))[:, None]

    return draw


def _sea(rng: np.random.Generator) -> Drawing:
    seed, sail = int(rng.integers(2**31)), rng.uniform(0.3, 0.7)

    def draw(p: Array) -> Array:
        u, v = p.T
        image = mix((0.9, 0.8, 0.62), (0.4, 0.62, 0.85), (v - 0.45) * 2)
        waves = noise(p, np.array([0.15, 0.02]), seed)
        sea = mix((0.08, 0.28, 0.45), (0.3, 0.6, 0.68), waves)
        image[v < 0.45] = sea[v < 0.45]
        image[(np.abs(u - sail) < 0.12 * (0.85 - v)) & (v > 0.4) & (v < 0.85)] = (0.92, 0.9, 0.84)
        image[(np.abs(u - sail) < 0.13) & (np.abs(v - 0.38) < 0.03)] = (0.4, 0.2, 0.12)
        return image

    return draw


def _blocks(rng: np.random.Generator) -> Drawing:
    columns, rows = np.sort(rng.uniform(0.1, 0.9, 3)), np.sort(rng.uniform(0.1, 0.9, 3))
    colours = np.array([pick(rng, FABRICS + PAINTS + ((0.9, 0.9, 0.86),) * 6) for _ in range(16)])

    def draw(p: Array) -> Array:
        i, j = np.searchsorted(columns, p[:, 0]), np.searchsorted(rows, p[:, 1])
        image = colours[4 * i + j]
        near = np.minimum(
            np.abs(p[:, :1] - columns).min(axis=1), np.abs(p[:, 1:] - rows).min(axis=1)
        )
        return np.where((near < 0.014)[:, None], 0.07, image)

    return draw


def _flowers(rng: np.random.Generator) -> Drawing:
    centres = rng.uniform((0.2, 0.45), (0.8, 0.85), (9, 2))
    colours = [pick(rng, FLOWERS) for _ in centres]
    ground, vase = pick(rng, PAINTS), pick(rng, FABRICS)

    def draw(p: Array) -> Array:
        u, v = p.T
        image = mix(np.multiply(ground, 0.7), ground, v)
        image[v < 0.15] = (0.45, 0.28, 0.17)
        for x, y in centres:
            stem = np.abs(u - (0.5 + (x - 0.5) * (v - 0.3) / (y - 0.3))) < 0.012
            image[stem & (v > 0.3) & (v < y)] = (0.2, 0.4, 0.15)
        for (x, y), colour in zip(centres, colours, strict=True):
            r, a = np.hypot(u - x, v - y), np.arctan2(v - y, u - x)
            image[r < 0.085 + 0.03 * np.cos(6 * a)] = colour
            image[r < 0.03] = (0.9, 0.75, 0.25)
        image[(np.abs(u - 0.5) < 0.08 + 0.06 * np.sin(np.clip(v, 0, 0.4) * 9)) & (v > 0.08)
              & (v < 0.4)] = vase  # fmt: skip
        return image

    return draw


def _rings(rng: np.random.Generator) -> Drawing:
    ground = pick(rng, PAINTS)
    discs = [(rng.random(2), rng.uniform(0.1, 0.35), pick(rng, FABRICS, 0.1)) for _ in range(7)]

    def draw(p: Array) -> Array:
        image = np.tile(np.array(ground), (len(p), 1))
        for centre, radius, colour in discs:
            r = np.linalg.norm(p - centre, axis=1)
            image[(r < radius) & (r > radius * 0.35)] = colour
        return image

    return draw
