"""The seam between images and an agent's view features, and the ViT encoder."""

from typing import Protocol

import torch.nn.functional as F
from torch import Tensor, nn

from vlnhijack.agents.vit import VisionTransformer

_CROP_FRACTION = 0.9


class ViewEncoder(Protocol):
    """Encodes images of single views; differentiable in the images."""

    @property
    def feature_size(self) -> int: ...

    @property
    def image_size(self) -> tuple[int, int]:
        """(height, width) in pixels at which images need no resizing."""
        ...

    def __call__(self, images: Tensor) -> Tensor:
        """Display values (V,3,H,W) in [0,1] to features (V,D)."""
        ...


class VitEncoder(nn.Module):
    """A ViT with HAMT's preprocessing (timm, mean = std = 0.5)."""

    def __init__(self, vit: VisionTransformer) -> None:
        super().__init__()
        self.vit = vit

    @property
    def feature_size(self) -> int:
        return self.vit.config.dim

    @property
    def image_size(self) -> tuple[int, int]:
        return self.vit.config.image_size

    def forward(self, images: Tensor) -> Tensor:
        return self.vit(normalise(resize_and_crop(images, self.image_size)))


def normalise(images: Tensor) -> Tensor:
    """Display values in [0,1] to [-1,1]: mean = std = 0.5."""
    return images * 2 - 1


def resize_and_crop(images: Tensor, size: tuple[int, int]) -> Tensor:
    """(V,3,h,w) to (V,3,*size); images of that size already are left as they are.

    timm's evaluation transform (antialiased bicubic, central 90 %: for 224, the shorter side to 248
    and a centre crop) without its 8-bit rounding, so linear in the images and free to overshoot.
    """
    height, width = images.shape[-2:]
    if (height, width) == size:
        return images
    scale = max(int(size[0] / _CROP_FRACTION) / height, int(size[1] / _CROP_FRACTION) / width)
    scaled = (int(height * scale + 1e-6), int(width * scale + 1e-6))
    images = F.interpolate(images, scaled, mode="bicubic", antialias=True)
    top, left = round((scaled[0] - size[0]) / 2), round((scaled[1] - size[1]) / 2)
    return images[..., top : top + size[0], left : left + size[1]]
