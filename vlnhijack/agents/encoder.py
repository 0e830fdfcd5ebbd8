"""The seam between images and an agent's view features, and the encoder of ViT and CLIP."""

from dataclasses import dataclass
from typing import Protocol

from torch import Tensor, nn

from vlnhijack.agents.clip import ClipVisual
from vlnhijack.agents.resize import TIMM_CROP, resize_and_crop
from vlnhijack.agents.vit import VisionTransformer


class ViewEncoder(Protocol):
    """Encodes images of single views; differentiable in the images."""

    @property
    def feature_size(self) -> int: ...

    @property
    def image_size(self) -> tuple[int, int]:
        """(height, width) in pixels of the views that it is given."""
        ...

    def __call__(self, images: Tensor) -> Tensor:
        """Display values (V,3,H,W) in [0,1] to features (V,D)."""
        ...


@dataclass(frozen=True)
class Preprocessing:
    """Mean and standard deviation of each channel; share of the shorter side that is kept."""

    mean: tuple[float, ...]
    std: tuple[float, ...]
    crop: float


TIMM = Preprocessing((0.5, 0.5, 0.5), (0.5, 0.5, 0.5), TIMM_CROP)
CLIP = Preprocessing(
    (0.48145466, 0.4578275, 0.40821073), (0.26862954, 0.26130258, 0.27577711), crop=1.0
)


class VitEncoder(nn.Module):
    """A ViT with HAMT's preprocessing (timm's), or CLIP's vision transformer with OpenAI's.

    image_size: (height, width) of the views; without it, that of the transformer.
    """

    def __init__(
        self, vit: VisionTransformer | ClipVisual, image_size: tuple[int, int] | None = None
    ) -> None:
        super().__init__()
        self.vit = vit
        self.preprocessing = CLIP if isinstance(vit, ClipVisual) else TIMM
        self._image_size = image_size or vit.config.image_size

    @property
    def feature_size(self) -> int:
        return self.vit.config.feature_size

    @property
    def image_size(self) -> tuple[int, int]:
        return self._image_size

    def forward(self, images: Tensor) -> Tensor:
        how = self.preprocessing
        resized = resize_and_crop(images, self.vit.config.image_size, how.crop)
        return self.vit(normalise(resized, how))


def normalise(images: Tensor, how: Preprocessing = TIMM) -> Tensor:
    """Display values in [0,1] to (value − mean) / std; [-1,1] with timm's 0.5."""
    mean, std = (images.new_tensor(values)[:, None, None] for values in (how.mean, how.std))
    return (images - mean) / std
