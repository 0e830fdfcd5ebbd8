"""A frozen renderer and the agent's linear resizing as one operator."""

import torch
from torch import Tensor

from vlnhijack.errors import InputError
from vlnhijack.rendering.frozen_renderer import FrozenRenderer
from vlnhijack.rendering.renderer import Renderer, require_texture
from vlnhijack.rendering.samples import image_size
from vlnhijack.rendering.transport import Transport, csr_of_entries, with_adjoint


class FoldedRenderer:
    """vertical · image · horizontalᵀ · scale + offset of every view and channel of a renderer.

    vertical (h',h) and horizontal (w',w) are those of `resize_matrices`, scale and offset those of
    a normalisation. Nothing is clipped, so this is the float resize, not PIL's. Raises InputError
    for another renderer than the frozen one, since only baked houses are linear in the texture, and
    for matrices of another size than the images.
    """

    def __init__(
        self,
        renderer: Renderer,
        vertical: Tensor,
        horizontal: Tensor,
        scale: float = 1.0,
        offset: float = 0.0,
    ) -> None:
        if not isinstance(renderer, FrozenRenderer):
            raise InputError(
                field="renderer",
                expected="a FrozenRenderer: resizing folds into baked houses only",
                received=type(renderer).__name__,
            )
        width, height = image_size(renderer.cameras)
        if (vertical.shape[1], horizontal.shape[1]) != (height, width):
            raise InputError(
                field="vertical, horizontal",
                expected=f"{height} and {width} columns",
                received=f"{vertical.shape[1]} and {horizontal.shape[1]}",
            )
        self.cameras = renderer.cameras
        self.texture_shape = renderer.texture_shape
        self._size = (vertical.shape[0], horizontal.shape[0])
        device = renderer.background.device
        vertical, horizontal = vertical.to(device), horizontal.to(device)
        self.transport = _resized(renderer.transport, vertical, horizontal, scale)
        images = renderer.background.view(-1, height, width, 3).permute(0, 3, 1, 2)
        rest = scale * (vertical @ images @ horizontal.T) + offset
        self.background = rest.permute(0, 2, 3, 1).reshape(-1, 3)

    def __call__(self, texture: Tensor) -> Tensor:
        """Resized images (V,3,h',w') of a texture (H,W,3); InputError for another shape."""
        require_texture(texture, self.texture_shape)
        image = self.background + self.transport(texture.to(self.background.device))
        return image.view(-1, *self._size, 3).permute(0, 3, 1, 2).to(texture.device)


def _resized(transport: Transport, vertical: Tensor, horizontal: Tensor, scale: float) -> Transport:
    """The operator whose images are resized and scaled: one product with all views side by side."""
    resize = scale * _kronecker(vertical, horizontal)
    resized, pixels = resize.shape
    rows, columns = transport.forward.to_sparse_coo().indices()
    views, texels = len(transport.forward) // pixels, transport.forward.shape[1]
    place = torch.stack([rows % pixels, rows // pixels * texels + columns])
    shape = (pixels, views * texels)
    beside = _sparse(place, transport.forward.values(), shape)
    product = torch.sparse.mm(resize, beside).coalesce()
    pixel, column = product.indices()
    rows = column // texels * resized + pixel
    order = torch.argsort(rows, stable=True)
    forward = csr_of_entries(
        rows[order],
        (column % texels)[order].int(),
        product.values()[order],
        (views * resized, texels),
    )
    return with_adjoint(forward, transport.texture_shape)


def _kronecker(vertical: Tensor, horizontal: Tensor) -> Tensor:
    """The sparse matrix (h'·w', h·w) of vertical · image · horizontalᵀ."""
    (i, y), (j, x) = vertical.nonzero().T, horizontal.nonzero().T
    rows = i[:, None] * horizontal.shape[0] + j
    columns = y[:, None] * horizontal.shape[1] + x
    values = vertical[i, y][:, None] * horizontal[j, x]
    shape = (vertical.shape[0] * horizontal.shape[0], vertical.shape[1] * horizontal.shape[1])
    place = torch.stack([rows.ravel(), columns.ravel()])
    return _sparse(place, values.ravel(), shape).coalesce()


def _sparse(place: Tensor, values: Tensor, shape: tuple[int, int]) -> Tensor:
    return torch.sparse_coo_tensor(place, values, shape, check_invariants=False)
