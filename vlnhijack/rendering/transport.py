"""Light transport of a baked house as a sparse matrix: image = b + A·t.

A maps the texels t of one texture to pixels. It is a pure function of where the camera rays hit the
object: each hit adds its bilinear weights over the number of samples, as Mitsuba's box filter and
bitmap texture (bilinear, clamped) do. Design section 5.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from scipy import sparse
from torch import Tensor
from torch.autograd.function import once_differentiable


@dataclass(frozen=True, eq=False)
class Transport:
    """A in both directions, over the C texels that weigh on any of P pixels.

    forward (P,C) and adjoint (C,P) are CSR tensors; texels (C,) int64 index the texture (H·W).
    """

    forward: Tensor
    adjoint: Tensor
    texels: Tensor
    texture_shape: tuple[int, int, int]

    def __call__(self, texture: Tensor) -> Tensor:
        """Radiance (P,3) of the object with a texture (H,W,3); differentiable once."""
        image: Tensor = _Apply.apply(texture, self)
        return image

    def double(self) -> "Transport":
        """The same matrix with float64 entries, for finite differences."""
        return Transport(
            self.forward.double(), self.adjoint.double(), self.texels, self.texture_shape
        )


class _Apply(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, texture: Tensor, transport: Transport) -> Tensor:
        ctx.transport = transport
        return transport.forward @ texture.reshape(-1, 3)[transport.texels]

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, image_gradient: Tensor) -> tuple[Tensor, None]:
        transport = ctx.transport
        height, width, _ = transport.texture_shape
        gradient = image_gradient.new_zeros(height * width, 3)
        gradient[transport.texels] = transport.adjoint @ image_gradient.contiguous()
        return gradient.view(transport.texture_shape), None


def transport_rows(
    pixel: NDArray[np.integer],
    uv: NDArray[np.float32],
    weight: float,
    pixels: int,
    texture_shape: tuple[int, int, int],
) -> sparse.csr_array:
    """Rows (P,H·W) of A of K hits: pixel (K,) they belong to and uv (K,2); duplicates summed.

    weight is that of one camera ray in its pixel.
    """
    height, width, _ = texture_shape
    texel, share = bilinear(uv, height, width)
    entries = (
        (weight * share).ravel().astype(np.float64),
        (np.repeat(pixel.astype(np.int32), 4), texel.ravel().astype(np.int32)),
    )
    rows = sparse.coo_array(entries, shape=(pixels, height * width)).tocsr()
    rows.eliminate_zeros()
    return rows


def bilinear(
    uv: NDArray[np.float32], height: int, width: int
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """Texels (K,4), as indices into (H·W), and weights (K,4) of a lookup at uv (K,2).

    The position is u·W − ½, neighbours are clamped to the texture (mi.Bitmap, wrap mode clamp).
    """
    position = uv * np.array([width, height], np.float32) - np.float32(0.5)
    low = np.floor(position)
    upper = position - low
    corner = low.astype(np.int64)
    columns = np.clip(np.stack([corner[:, 0], corner[:, 0] + 1], 1), 0, width - 1)
    rows = np.clip(np.stack([corner[:, 1], corner[:, 1] + 1], 1), 0, height - 1)
    share = np.stack([1 - upper, upper], 1)
    texel = rows[:, :, None] * width + columns[:, None, :]
    weight = share[:, :, None, 1] * share[:, None, :, 0]
    return texel.reshape(-1, 4), weight.reshape(-1, 4)


def assemble(parts: Sequence[sparse.csr_array], texture_shape: tuple[int, int, int]) -> Transport:
    """The operator whose rows are those of the parts (P_i,H·W), one below the other."""
    matrix = sparse.vstack(parts, format="csr")
    texels, columns = np.unique(matrix.indices, return_inverse=True)
    shape = (matrix.shape[0], len(texels))
    matrix = sparse.csr_array((matrix.data, columns.astype(np.int32), matrix.indptr), shape=shape)
    matrix.sort_indices()
    return Transport(
        _csr(matrix),
        _csr(matrix.T.tocsr()),
        torch.from_numpy(texels.astype(np.int64)),
        texture_shape,
    )


def _csr(matrix: sparse.csr_array) -> Tensor:
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Sparse CSR tensor support is in beta")
        return torch.sparse_csr_tensor(
            torch.from_numpy(matrix.indptr.astype(np.int32)),
            torch.from_numpy(matrix.indices.astype(np.int32)),
            torch.from_numpy(matrix.data.astype(np.float32)),
            size=matrix.shape,
            check_invariants=True,
        )
