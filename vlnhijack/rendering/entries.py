"""The entries of the transport operator, from the camera rays of a run; Dr.Jit on the device.

A pixel's row gathers from the rays of all pixels that its film filter reaches: the rays' texels, as
often as they are looked up, are sorted within the row and those that are the same are summed. Rows
are worked off in tiles, whose size changes no bit of the result.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import torch
from torch import Tensor

from vlnhijack.rendering.filters import Filters, film_filter, texel_of
from vlnhijack.rendering.samples import border_of
from vlnhijack.rendering.sorting import sort_rows
from vlnhijack.rendering.trace import Samples
from vlnhijack.rendering.variant import activate

MAX_MEMORY = 512.0
_ENTRY_BYTES = 64
_NONE = 0x7FFFFFFF


class Entries(NamedTuple):
    """E entries sorted by pixel, then texel; values (E, channels). No pair occurs twice."""

    pixel: Tensor
    texel: Tensor
    values: Tensor


def background(samples: Samples, filters: Filters) -> Tensor:
    """Radiance (pixels, 3) of everything but the object."""
    *sums, weight = _film_sums(samples, filters, [*samples.met.rest])
    return torch.stack([(channel / weight).torch() for channel in sums], 1)


def entries(
    samples: Samples, texture_shape: tuple[int, int, int], filters: Filters, max_memory: float
) -> Iterator[Entries]:
    """The entries of a run, tile by tile; at most about max_memory megabytes for each tile."""
    mi = activate()
    import drjit as dr

    *light, weight = _film_sums(samples, filters, samples.met.light)
    lit: Any = dr.compress(sum(light) > 0)
    per_row = _reach(samples, filters) * filters.taps
    length = max(1, int(max_memory * 1e6) // (_ENTRY_BYTES * per_row))
    if len(lit) == 0:
        yield _no_entries(len(light), weight.torch().device)
    for first in range(0, len(lit), length):
        count = min(length, len(lit) - first)
        pixel = dr.gather(mi.UInt32, lit, dr.arange(mi.UInt32, count) + dr.opaque(mi.UInt32, first))
        dr.eval(pixel)
        keys, values = _lookups(samples, texture_shape, filters, pixel)
        keys = type(keys)(sort_rows(keys.torch().view(-1, per_row)).ravel())
        found = _merged(keys, values, per_row, pixel, weight)
        yield found._replace(pixel=found.pixel + samples.first)


def _no_entries(channels: int, device: torch.device) -> Entries:
    index = torch.zeros(0, dtype=torch.int32, device=device)
    return Entries(index, index, torch.zeros(0, channels, device=device))


def _reach(samples: Samples, filters: Filters) -> int:
    """Rays that a pixel gathers from."""
    return int(samples.spp * (2 * border_of(filters.film) + 1) ** 2)


def _film_weights(samples: Samples, filters: Filters) -> Callable[[Any, Any], tuple[Any, Any]]:
    """Maps pixel and number (< _reach) to a ray of the run and its weight in that pixel."""
    mi = activate()
    import drjit as dr

    width, height = samples.size
    border = border_of(filters.film)
    film, side = film_filter(filters), 2 * border + 1
    spp = dr.opaque(mi.UInt32, samples.spp)

    def weight(pixel: Any, number: Any) -> tuple[Any, Any]:
        row, view = pixel // width, pixel // (width * height)
        neighbour = number // spp
        x = pixel - row * width + neighbour % side
        y = row + view * (2 * border) + neighbour // side
        ray = (y * (width + 2 * border) + x) * spp + number % spp
        if film.is_box_filter():
            return ray, mi.Float(1)
        position = dr.gather(mi.Point2f, samples.position, ray)
        centre = mi.Point2f(
            mi.Float(x - neighbour % side) + border, mi.Float(y - neighbour // side) + border
        )
        offset = position - centre - 0.5
        return ray, film.eval(offset.x) * film.eval(offset.y)

    return weight


def _film_sums(samples: Samples, filters: Filters, channels: Sequence[Any]) -> list[Any]:
    """Filtered sums (pixels,) of channels of the rays; last, that of the weights."""
    mi = activate()
    import drjit as dr

    width, height = samples.size
    pixel = dr.arange(mi.UInt32, samples.views * width * height)
    weight_of, reach = (
        _film_weights(samples, filters),
        dr.opaque(mi.UInt32, _reach(samples, filters)),
    )

    def add(number: Any, sums: list[Any]) -> tuple[Any, list[Any]]:
        ray, weight = weight_of(pixel, number)
        found = [dr.gather(mi.Float, channel, ray) for channel in channels] + [mi.Float(1)]
        return number + 1, [total + weight * x for total, x in zip(sums, found, strict=True)]

    start = (mi.UInt32(0), [mi.Float(0) for _ in (*channels, 1)])
    _, sums = dr.while_loop(start, lambda number, _: number < reach, add)
    dr.eval(sums)
    return sums


def _lookups(
    samples: Samples, texture_shape: tuple[int, int, int], filters: Filters, pixel: Any
) -> tuple[Any, list[Any]]:
    """Keys (texel, then number in the row) and values of all lookups, row after row of `pixel`."""
    mi = activate()
    import drjit as dr

    per_row = _reach(samples, filters) * filters.taps
    index = dr.arange(mi.UInt32, len(pixel) * per_row)
    row = index // dr.opaque(mi.UInt32, per_row)
    number = index - row * dr.opaque(mi.UInt32, per_row)
    ray, weight = _film_weights(samples, filters)(
        dr.gather(mi.UInt32, pixel, row), number // filters.taps
    )
    uv = dr.gather(mi.Point2f, samples.met.uv, ray)
    texel, share = texel_of(uv, number % filters.taps, texture_shape, filters)
    values = [weight * share * dr.gather(mi.Float, light, ray) for light in samples.met.light]
    texel = dr.select(sum(values) > 0, mi.Int64(texel), _NONE)
    key = (texel << 32) | mi.Int64(number)
    dr.eval(key, values)
    return key, values


def _merged(keys: Any, values: Sequence[Any], per_row: int, pixel: Any, weight: Any) -> Entries:
    """Sums over equal texels of each row, in the order of rays, over the sum of film weights."""
    mi = activate()
    import drjit as dr

    length = dr.opaque(mi.UInt32, per_row)
    index = dr.arange(mi.UInt32, len(keys))
    texel = keys >> 32
    before = dr.gather(mi.Int64, keys, dr.maximum(index, 1) - 1) >> 32
    is_first = (texel != _NONE) & ((texel != before) | (index % length == 0))
    first: Any = dr.compress(is_first)
    row = first // length
    end = (row + 1) * length
    found = dr.gather(mi.Int64, keys, first) >> 32

    def same(index: Any, _: list[Any]) -> Any:
        here = dr.gather(mi.Int64, keys, index, index < end)
        return (index < end) & (here >> 32 == found)

    def add(index: Any, sums: list[Any]) -> tuple[Any, list[Any]]:
        number = mi.UInt32(dr.gather(mi.Int64, keys, index) & 0xFFFFFFFF)
        at = row * length + number
        return index + 1, [
            total + dr.gather(mi.Float, value, at)
            for total, value in zip(sums, values, strict=True)
        ]

    _, sums = dr.while_loop((first, [mi.Float(0) for _ in values]), same, add)
    here = dr.gather(mi.UInt32, pixel, row)
    norm = dr.gather(mi.Float, weight, here)
    texel, here = mi.Int32(found), mi.Int32(here)
    sums = [total / norm for total in sums]
    dr.eval(texel, here, sums)
    return Entries(here.torch(), texel.torch(), torch.stack([x.torch() for x in sums], 1))
