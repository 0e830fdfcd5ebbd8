"""Repeatable value noise over 3D space, by hashing lattice cells."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_PRIMES = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)


def hashed(cells: NDArray[np.int64], seed: int) -> Array:
    """Uniform numbers in [0,1) (K,) for integer cells (K,D), D ≤ 3."""
    x = np.full(len(cells), seed, np.uint64)
    for column, prime in zip(cells.T, _PRIMES, strict=False):
        x = (x ^ (column.astype(np.uint64) * prime)) * np.uint64(0xBF58476D1CE4E5B9)
        x ^= x >> np.uint64(29)
    x *= np.uint64(0x94D049BB133111EB)
    x ^= x >> np.uint64(32)
    return (x >> np.uint64(11)).astype(np.float64) * 2.0**-53


def noise(points: Array, cell: float | Array, seed: int) -> Array:
    """Smooth value noise in [0,1] (K,) at points (K,D), one lattice cell `cell` metres wide."""
    q = points / cell
    base = np.floor(q).astype(np.int64)
    f = q - base
    f = f * f * (3 - 2 * f)
    total = np.zeros(len(points))
    for corner in np.ndindex(*(2,) * points.shape[1]):
        weight = np.prod(np.where(corner, f, 1 - f), axis=1)
        total += weight * hashed(base + np.array(corner), seed)
    return total


def fractal(points: Array, cell: float | Array, seed: int, octaves: int = 3) -> Array:
    """Sum of `octaves` noises, each twice as fine and half as strong, in [0,1]."""
    total, weight = np.zeros(len(points)), 0.0
    for octave in range(octaves):
        total += 0.5**octave * noise(points, np.asarray(cell) / 2**octave, seed + octave)
        weight += 0.5**octave
    return total / weight
