"""The one seam of rendering: a texture of one object in, images of V cameras out."""

from collections.abc import Sequence
from typing import Protocol

from torch import Tensor

from vlnhijack.errors import InputError
from vlnhijack.frames import Camera


class Renderer(Protocol):
    """Maps a texture (H,W,3) to images (V,3,h,w), both display values; differentiable.

    Raises InputError where the texture has another shape than `texture_shape`.
    """

    @property
    def texture_shape(self) -> tuple[int, int, int]: ...

    @property
    def cameras(self) -> Sequence[Camera]: ...

    def __call__(self, texture: Tensor) -> Tensor: ...


def require_texture(texture: Tensor, shape: tuple[int, int, int]) -> None:
    """Raises InputError unless the texture has that shape."""
    if tuple(texture.shape) != shape:
        raise InputError(field="texture", expected=shape, received=tuple(texture.shape))
