"""The views that an attack renders, and where their features belong."""

from dataclasses import dataclass

import torch
from torch import Tensor

from vlnhijack.agents.encoder import ViewEncoder
from vlnhijack.rendering.renderer import Renderer


@dataclass(frozen=True, eq=False)
class AttackedViews:
    """The views that the attack renders: V cameras, and their place in the feature table.

    clean (M,36,D) features of all viewpoints; viewpoints (V,) rows and views (V,) columns of the
    features that are replaced.
    """

    renderer: Renderer
    encoder: ViewEncoder
    clean: Tensor
    viewpoints: Tensor
    views: Tensor

    def features(self, texture: Tensor) -> Tensor:
        """All features (M,36,D) with those of the rendered views replaced; differentiable."""
        return self.replaced(self.renderer(texture))

    def replaced(self, images: Tensor) -> Tensor:
        """`features` of the images (V,3,h,w) of the rendered views."""
        return self.clean.index_put((self.viewpoints, self.views), self.encoder(images))

    def changing(self) -> Tensor:
        """Which of the M viewpoints (M,) bool have a rendered view."""
        changing = torch.zeros(len(self.clean), dtype=torch.bool)
        changing[self.viewpoints] = True
        return changing
