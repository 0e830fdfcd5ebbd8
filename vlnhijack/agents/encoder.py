"""The seam between images and an agent's view features, and the ViT encoder."""

from typing import Protocol

from torch import Tensor, nn

from vlnhijack.agents.resize import resize_and_crop
from vlnhijack.agents.vit import VisionTransformer


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
