"""The transport operator once more: float64, a loop per sample, a dense matrix. Slow and obvious.

It shares no code with the operator. What it takes as given is where the rays hit, and Mitsuba's
film filter, which is tabulated as Mitsuba evaluates it.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np


class Hit(NamedTuple):
    """A camera ray: its view, where it meets the film and the object, and the light there.

    x and y are pixels of the view, which may lie outside it; uv is None where the object is missed.
    """

    view: int
    x: float
    y: float
    uv: tuple[float, float] | None
    light: float = 1.0


def dense_operator(
    hits: list[Hit],
    views: int,
    size: tuple[int, int],
    texture: tuple[int, int],
    lookup: str = "bilinear",
    wrap: str = "clamp",
    film: Callable[[float], float] | None = None,
) -> np.ndarray:
    """A (V·h·w, H·W); film is the filter's profile, None a box of one pixel."""
    width, height = size
    rows, columns = texture
    matrix = np.zeros((views, height, width, rows * columns))
    norm = np.zeros((views, height, width))
    for hit in hits:
        for y, x, weight in _pixels(hit, size, film):
            norm[hit.view, y, x] += weight
            if hit.uv is not None:
                for row, column, share in _texels(hit.uv, rows, columns, lookup):
                    texel = _wrap(row, rows, wrap) * columns + _wrap(column, columns, wrap)
                    matrix[hit.view, y, x, texel] += weight * share * hit.light
    return (matrix / norm[..., None]).reshape(-1, rows * columns)


def _pixels(
    hit: Hit, size: tuple[int, int], film: Callable[[float], float] | None
) -> list[tuple[int, int, float]]:
    width, height = size
    found = []
    for y in range(height):
        for x in range(width):
            dx, dy = hit.x - (x + 0.5), hit.y - (y + 0.5)
            if film is None:
                inside = math.floor(hit.x) == x and math.floor(hit.y) == y
                weight = 1.0 if inside else 0.0
            else:
                weight = film(dx) * film(dy) if max(abs(dx), abs(dy)) < 2 else 0.0
            if weight > 0:
                found.append((y, x, weight))
    return found


def _texels(
    uv: tuple[float, float], rows: int, columns: int, lookup: str
) -> list[tuple[int, int, float]]:
    if lookup == "nearest":
        return [(math.floor(uv[1] * rows), math.floor(uv[0] * columns), 1.0)]
    x, y = uv[0] * columns - 0.5, uv[1] * rows - 0.5
    left, top = math.floor(x), math.floor(y)
    return [
        (top, left, (1 - (x - left)) * (1 - (y - top))),
        (top, left + 1, (x - left) * (1 - (y - top))),
        (top + 1, left, (1 - (x - left)) * (y - top)),
        (top + 1, left + 1, (x - left) * (y - top)),
    ]


def _wrap(index: int, size: int, wrap: str) -> int:
    if wrap == "repeat":
        return index % size
    if wrap == "mirror":
        folded = index % (2 * size)
        return folded if folded < size else 2 * size - 1 - folded
    return min(max(index, 0), size - 1)
