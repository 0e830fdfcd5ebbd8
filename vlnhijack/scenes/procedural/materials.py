"""Solid textures: colours as functions of a place, so that they have no seams.

A material maps points (K,3) in local metres and unit normals (K,3) to sRGB display colours (K,3)
in [0,1]. Every factory draws what it is not told (colour, pattern, scale) from `rng`. Colours
stay in [0.04, 0.93], the range of real albedos.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vlnhijack.scenes.procedural.noise import fractal, hashed, noise

Array = NDArray[np.float64]
Floats = NDArray[np.floating]
Material = Callable[[Array, Array], Array]
Colour = tuple[float, float, float]

WOODS: tuple[Colour, ...] = (
    (0.70, 0.50, 0.30), (0.55, 0.34, 0.18), (0.36, 0.21, 0.12), (0.84, 0.68, 0.47),
    (0.60, 0.28, 0.16), (0.26, 0.17, 0.12), (0.76, 0.58, 0.38), (0.88, 0.84, 0.76),
)  # fmt: skip
FABRICS: tuple[Colour, ...] = (
    (0.16, 0.27, 0.52), (0.62, 0.15, 0.18), (0.18, 0.47, 0.44), (0.85, 0.66, 0.22),
    (0.50, 0.50, 0.52), (0.84, 0.78, 0.68), (0.27, 0.40, 0.22), (0.78, 0.42, 0.26),
    (0.48, 0.28, 0.50), (0.86, 0.60, 0.62), (0.28, 0.24, 0.24), (0.45, 0.63, 0.76),
)  # fmt: skip
LEATHERS: tuple[Colour, ...] = (
    (0.35, 0.19, 0.11), (0.13, 0.12, 0.12), (0.58, 0.34, 0.19), (0.47, 0.13, 0.12),
    (0.83, 0.78, 0.69),
)  # fmt: skip
PAINTS: tuple[Colour, ...] = (
    (0.90, 0.89, 0.86), (0.55, 0.67, 0.62), (0.29, 0.38, 0.48), (0.80, 0.74, 0.62),
    (0.70, 0.30, 0.26), (0.85, 0.75, 0.42), (0.30, 0.42, 0.32), (0.62, 0.70, 0.80),
)  # fmt: skip
FLOWERS: tuple[Colour, ...] = (
    (0.88, 0.20, 0.22), (0.92, 0.72, 0.15), (0.90, 0.50, 0.70), (0.90, 0.88, 0.85),
    (0.58, 0.32, 0.75), (0.92, 0.48, 0.18),
)  # fmt: skip
GREENS: tuple[Colour, ...] = (
    (0.20, 0.42, 0.14), (0.33, 0.52, 0.17), (0.12, 0.34, 0.20), (0.42, 0.55, 0.28),
)  # fmt: skip


def pick(rng: np.random.Generator, palette: Sequence[Colour], spread: float = 0.05) -> Colour:
    """A colour of the palette, shifted by up to `spread`."""
    colour = np.array(palette[int(rng.integers(len(palette)))]) + rng.uniform(-spread, spread, 3)
    red, green, blue = np.clip(colour, 0.05, 0.92)
    return float(red), float(green), float(blue)


def shade(colour: ArrayLike, factor: float) -> Colour:
    """The colour made darker (factor < 1) or lighter."""
    red, green, blue = np.clip(np.asarray(colour, float) * factor, 0.04, 0.93)
    return float(red), float(green), float(blue)


def mix(first: ArrayLike, second: ArrayLike, amount: Floats) -> Array:
    """Colours (K,3) between two colours (3,) or (K,3); amount (K,) in [0,1]."""
    a, b = np.asarray(first, float), np.asarray(second, float)
    return a + (b - a) * np.clip(amount, 0, 1)[:, None]


def seed_from(rng: np.random.Generator) -> int:
    """A seed for `noise`."""
    return int(rng.integers(2**31))


def legal(colours: Array) -> Array:
    """Colours (K,3) within the range of real albedos."""
    return np.clip(colours, 0.04, 0.93)


def solid(colour: Colour) -> Material:
    """One colour everywhere, with the slightest mottle."""

    def evaluate(points: Array, normals: Array) -> Array:
        return legal(np.array(colour) * (0.97 + 0.06 * noise(points, 0.11, 7))[:, None])

    return evaluate


def wood(rng: np.random.Generator, colour: Colour | None = None, axis: int = 2) -> Material:
    """Wood whose grain runs along axis 0, 1 or 2."""
    base = np.array(colour or pick(rng, WOODS, 0.03))
    seed, ring = seed_from(rng), rng.uniform(0.03, 0.06)
    stretch = np.full(3, 0.09)
    stretch[axis] = 0.9

    def evaluate(points: Array, normals: Array) -> Array:
        across = np.delete(points, axis, axis=1)
        bend = 0.10 * fractal(points, stretch * 2, seed, 2)
        grain = 0.5 + 0.5 * np.sin((across @ (1.0, 0.6) + bend) * 2 * np.pi / ring)
        fibre = noise(points, stretch / 5, seed + 9)
        tone = 0.80 + 0.22 * grain * fibre + 0.16 * fractal(points, stretch, seed + 5, 2)
        return legal(base * tone[:, None])

    return evaluate


def fabric(
    rng: np.random.Generator, colour: Colour | None = None, pattern: str | None = None
) -> Material:
    """Upholstery: pattern "plain", "stripes", "plaid", "dots" or "damask"."""
    base = np.array(colour or pick(rng, FABRICS))
    accent = np.array(pick(rng, FABRICS))
    kinds = ["plain", "stripes", "plaid", "dots", "damask"]
    kind = pattern or str(rng.choice(kinds, p=[0.4, 0.18, 0.16, 0.13, 0.13]))
    seed, scale = seed_from(rng), rng.uniform(0.14, 0.24)

    def evaluate(points: Array, normals: Array) -> Array:
        weave = 0.90 + 0.12 * noise(points, 0.012, seed) + 0.06 * fractal(points, 0.2, seed + 3, 2)
        return legal(mix(base, accent, _pattern(kind, points, normals, scale)) * weave[:, None])

    return evaluate


def _pattern(kind: str, points: Array, normals: Array, scale: float) -> Array:
    if kind == "stripes":
        return (np.mod(points[:, 0] / scale, 1) < 0.4).astype(float)
    if kind == "plaid":
        bands = np.mod(points @ ((1, 0), (0, 1), (0, 1)) / scale, 1) < 0.35
        return 0.42 * bands.sum(axis=1)
    flat = _across(points, normals) / scale
    if kind == "dots":
        row = np.floor(flat[:, 1])
        shifted = np.stack([flat[:, 0] + row / 2, flat[:, 1]], axis=-1)
        return (np.linalg.norm(np.mod(shifted, 1) - 0.5, axis=1) < 0.28).astype(float)
    if kind == "damask":
        u, v = flat.T * np.pi
        return 0.75 * (np.sin(u) * np.sin(v) + 0.35 * np.sin(3 * u) * np.cos(3 * v) > 0.15)
    return np.zeros(len(points))


def _across(points: Array, normals: Array) -> Array:
    """(K,2) the two coordinates along which a face with these normals lies most."""
    axis = np.argmax(np.abs(normals), axis=1)
    flat = np.where((axis == 0)[:, None], points[:, [1, 2]], points[:, [0, 2]])
    return np.where((axis == 2)[:, None], points[:, [0, 1]], flat)


def leather(rng: np.random.Generator, colour: Colour | None = None) -> Material:
    """Smooth hide with creases and worn patches."""
    base = np.array(colour or pick(rng, LEATHERS, 0.03))
    seed = seed_from(rng)

    def evaluate(points: Array, normals: Array) -> Array:
        crease = np.abs(fractal(points, 0.07, seed, 3) - 0.5) * 2
        worn = fractal(points, 0.35, seed + 4, 2)
        tone = 0.82 + 0.2 * np.clip(crease * 4, 0, 1) + 0.25 * (worn - 0.5)
        return legal(base * tone[:, None] + 0.05 * np.clip(normals[:, 2:], 0, 1))

    return evaluate


def metal(rng: np.random.Generator, colour: Colour | None = None) -> Material:
    """Brushed metal with a painted highlight towards the light from above."""
    palette = [(0.62, 0.63, 0.65), (0.14, 0.14, 0.15), (0.75, 0.6, 0.3), (0.4, 0.4, 0.42)]
    base = np.array(colour or pick(rng, palette, 0.02))
    seed = seed_from(rng)

    def evaluate(points: Array, normals: Array) -> Array:
        brush = noise(points, np.array([0.2, 0.2, 0.01]), seed)
        gloss = np.clip(normals @ (0.3, 0.5, 0.8), 0, 1) ** 6
        return legal(base * (0.88 + 0.18 * brush)[:, None] + 0.25 * gloss[:, None])

    return evaluate


def leaves(rng: np.random.Generator, spread: float, top: float) -> Material:
    """Foliage round the z axis: several greens, darker inside than `spread` m, light at `top` m."""
    base = np.array(pick(rng, GREENS, 0.04))
    tip = np.clip(base * 1.35 + (0.10, 0.12, 0.0), 0, 0.9)
    seed = seed_from(rng)

    def evaluate(points: Array, normals: Array) -> Array:
        radius = np.hypot(points[:, 0], points[:, 1])
        inside = np.clip(np.maximum(radius / spread, (points[:, 2] / top) ** 3), 0, 1)
        spots = fractal(points, 0.10, seed, 3)
        up = 0.5 + 0.5 * normals[:, 2]
        colour = mix(base * 0.75, tip, 0.05 + 0.75 * inside * spots + 0.25 * up)
        return legal(colour * (0.5 + 0.55 * inside)[:, None])

    return evaluate


def ceramic(rng: np.random.Generator, colour: Colour = (0.90, 0.90, 0.88)) -> Material:
    """Glazed white ware, shinier where it looks up."""

    def evaluate(points: Array, normals: Array) -> Array:
        return legal(np.array(colour) * (0.86 + 0.12 * np.clip(normals[:, 2:], -1, 1)))

    return evaluate


def glazed(rng: np.random.Generator, colour: Colour | None = None) -> Material:
    """A pot's glaze: bands of two colours around the z axis."""
    base, band = colour or pick(rng, PAINTS + FABRICS), pick(rng, PAINTS)
    width = rng.uniform(0.08, 0.2)

    def evaluate(points: Array, normals: Array) -> Array:
        stripe = np.mod(points[:, 2] / width, 1) < 0.3
        return legal(mix(base, band, 0.8 * stripe) * (0.9 + 0.15 * normals[:, 2:]))

    return evaluate


def marble(rng: np.random.Generator, colour: Colour | None = None) -> Material:
    """Stone with dark or light veins."""
    base = np.array(colour or pick(rng, [(0.86, 0.85, 0.83), (0.22, 0.24, 0.23), (0.6, 0.5, 0.42)]))
    vein = base * 0.5 if base.mean() > 0.5 else base + 0.4
    seed = seed_from(rng)

    def evaluate(points: Array, normals: Array) -> Array:
        ridge = 1 - np.abs(fractal(points, 0.5, seed, 4) - 0.5) * 12
        cloud = fractal(points, 0.25, seed + 8, 3)
        return legal(mix(base * (0.9 + 0.15 * cloud)[:, None], vein, 0.7 * np.clip(ridge, 0, 1)))

    return evaluate


def speckled(rng: np.random.Generator, colour: Colour | None = None) -> Material:
    """Granite or terrazzo: chips of two other colours."""
    base = np.array(colour or pick(rng, [(0.3, 0.3, 0.32), (0.75, 0.72, 0.68), (0.5, 0.4, 0.34)]))
    chip = pick(rng, WOODS + PAINTS, 0.1)
    seed = seed_from(rng)

    def evaluate(points: Array, normals: Array) -> Array:
        grains = fractal(points, 0.03, seed, 2)
        return legal(mix(base * (0.8 + 0.4 * grains)[:, None], chip, 8 * (grains - 0.62)))

    return evaluate


def spots(rng: np.random.Generator, first: Colour, second: Colour, cell: float) -> Material:
    """Cells of `cell` metres that take either colour at random."""
    seed = seed_from(rng)

    def evaluate(points: Array, normals: Array) -> Array:
        return mix(first, second, hashed(np.floor(points / cell).astype(np.int64), seed))

    return evaluate
