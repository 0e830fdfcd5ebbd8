"""Light transport from one texture to pixels as a sparse matrix: image = b + A·t (design, 5).

A is fixed by geometry, camera rays and filters (see `entries`), and in a lit house by the light.
"""

import warnings
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import torch
from torch import Tensor
from torch.autograd.function import once_differentiable
from torch.nn.functional import embedding_bag

from vlnhijack.rendering.entries import Entries, background, entries
from vlnhijack.rendering.filters import Filters
from vlnhijack.rendering.sorting import stable_order
from vlnhijack.rendering.trace import Samples


@dataclass(frozen=True, eq=False)
class Transport:
    """A in both directions, between T = H·W texels and P pixels.

    forward (P,T) and adjoint (C,P) are CSR tensors with int32 indices; the rows of adjoint are the
    texels (C,) that weigh on any pixel, ascending. Where light is coloured they are (3P,3T) and
    (3C,3P), channel after channel of a pixel and of a texel, and channels is 3.
    """

    forward: Tensor
    adjoint: Tensor
    texels: Tensor
    texture_shape: tuple[int, int, int]
    channels: int = 1

    def __call__(self, texture: Tensor) -> Tensor:
        """Radiance (P,3) of the object with a texture (H,W,3); differentiable once."""
        image: Tensor = _Apply.apply(texture, self)
        return image

    def double(self) -> "Transport":
        """The same matrix with float64 entries, for finite differences."""
        return replace(self, forward=self.forward.double(), adjoint=self.adjoint.double())

    def product(self, matrix: Tensor, colours: Tensor) -> Tensor:
        """forward or adjoint times colours (…,3), as (K,3)."""
        if not colours.is_contiguous():  # .contiguous() of (K,3) from (3,K) takes five times longer
            colours = torch.stack(colours.unbind(-1), -1)
        return embedding_bag(
            matrix.col_indices(),
            colours.view(-1, 3 // self.channels),
            matrix.crow_indices(),
            mode="sum",
            per_sample_weights=matrix.values(),
            include_last_offset=True,
        ).view(-1, 3)


class _Apply(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, texture: Tensor, transport: Transport) -> Tensor:
        ctx.transport = transport
        return transport.product(transport.forward, texture)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, image_gradient: Tensor) -> tuple[Tensor, None]:
        transport = ctx.transport
        gradient = image_gradient.new_zeros(transport.texture_shape)
        gradient.view(-1, 3)[transport.texels] = transport.product(
            transport.adjoint, image_gradient
        )
        return gradient, None


def build(
    runs: Iterable[Samples],
    texture_shape: tuple[int, int, int],
    filters: Filters,
    max_memory: float,
) -> tuple[Transport, Tensor]:
    """A and b (P,3) of all runs; max_memory bounds, in megabytes, what the entries' tiles take."""
    rest: list[Tensor] = []
    tiles: list[Entries] = []
    for samples in runs:
        rest.append(background(samples, filters))
        tiles += entries(samples, texture_shape, filters, max_memory)
    everything = torch.cat(rest)
    return assemble(tiles, len(everything), texture_shape), everything


def assemble(
    tiles: Iterable[Entries], pixels: int, texture_shape: tuple[int, int, int]
) -> Transport:
    """The operator onto so many pixels with the entries of all tiles, which come in pixel order."""
    pixel, texel, values = (torch.cat(parts) for parts in zip(*tiles, strict=True))
    channels = values.shape[1]
    shape = (channels * pixels, channels * texture_shape[0] * texture_shape[1])
    rows, columns = (_by_channel(index, channels) for index in (pixel, texel))
    order = stable_order(rows) if channels > 1 else slice(None)
    forward = csr_of_entries(rows[order], columns[order], values.ravel()[order], shape)
    return with_adjoint(forward, texture_shape, channels)


def with_adjoint(
    forward: Tensor, texture_shape: tuple[int, int, int], channels: int = 1
) -> Transport:
    """The operator of a forward matrix."""
    pixels = torch.arange(forward.shape[0], device=forward.device, dtype=torch.int32)
    pixels = pixels.repeat_interleave(forward.crow_indices().diff())
    order = stable_order(forward.col_indices())
    counts = torch.bincount(forward.col_indices(), minlength=forward.shape[1]).view(-1, channels)
    (texels,) = counts.sum(1).nonzero(as_tuple=True)
    starts = _starts(counts[texels].ravel())
    shape = (len(starts) - 1, forward.shape[0])
    adjoint = csr(starts, pixels[order], forward.values()[order], shape)
    return Transport(forward, adjoint, texels.int(), texture_shape, channels)


def _by_channel(index: Tensor, channels: int) -> Tensor:
    """Index (E,) of pixels or texels to the int32 index (E·channels,) of their channels."""
    channel = torch.arange(channels, device=index.device)
    return (index[:, None] * channels + channel).int().ravel()


def csr_of_entries(rows: Tensor, columns: Tensor, values: Tensor, shape: tuple[int, int]) -> Tensor:
    """A CSR matrix of entries sorted by row, then column."""
    return csr(_starts(torch.bincount(rows, minlength=shape[0])), columns, values, shape)


def _starts(counts: Tensor) -> Tensor:
    """Row pointers (K+1,) int32 of rows with so many entries (K,)."""
    starts = torch.zeros(len(counts) + 1, dtype=torch.int32, device=counts.device)
    torch.cumsum(counts, 0, out=starts[1:])
    return starts


def csr(starts: Tensor, columns: Tensor, values: Tensor, shape: tuple[int, int]) -> Tensor:
    """A CSR matrix of its three arrays."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Sparse CSR tensor support is in beta")
        return torch.sparse_csr_tensor(starts, columns, values, size=shape, check_invariants=True)
