"""The views of one object that a benchmark renders."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import torch
from torch import Tensor

from vlnhijack import seeds
from vlnhijack.errors import InputError
from vlnhijack.frames import Camera
from vlnhijack.navigation.views import VIEWS, View, panorama_cameras
from vlnhijack.rendering.coverage import object_coverage
from vlnhijack.rendering.fixed_illumination import FixedIlluminationRenderer
from vlnhijack.rendering.frozen_renderer import FrozenRenderer
from vlnhijack.rendering.mitsuba_renderer import MitsubaRenderer
from vlnhijack.rendering.renderer import Renderer
from vlnhijack.scenes.house import House

RUNGS: dict[str, dict[str, Callable[..., Renderer]]] = {
    "baked": {"frozen": FrozenRenderer, "prb": MitsubaRenderer},
    "lit": {"fixed-illumination": FixedIlluminationRenderer, "prb": MitsubaRenderer},
}


@dataclass(frozen=True, eq=False)
class Subject:
    """Views of one object of a house, and a fixed random linear functional of them."""

    house: House
    object_id: str
    cameras: Sequence[Camera]

    @cached_property
    def weights(self) -> Tensor:
        """Weights (V,3,h,w) of the functional, normally distributed."""
        camera = self.cameras[0]
        shape = (len(self.cameras), 3, camera.height, camera.width)
        return torch.from_numpy(seeds.stream(0, "bench functional").standard_normal(shape)).float()

    def renderer(self, rung: str, spp: int, seed: int) -> Any:
        """A new renderer of a rung that suits the house's kind."""
        return RUNGS[self.house.kind][rung](self.house, self.object_id, self.cameras, spp, seed)

    def texture(self) -> Tensor:
        return torch.from_numpy(self.house.surface(self.object_id).texture)

    def gradient(self, renderer: Renderer) -> tuple[Tensor, Tensor]:
        """Images (V,3,h,w), and the gradient (H,W,3) of the functional."""
        texture = self.texture().requires_grad_()
        image = renderer(texture)
        (gradient,) = torch.autograd.grad(image, texture, self.weights)
        return image.detach(), gradient


def fullest_view(
    house: House, object_id: str | None = None, viewpoint: str | None = None
) -> tuple[str, View]:
    """The object, and the view, where an object fills the largest share of a view.

    object_id and viewpoint narrow the choice. Raises InputError where the house lacks them, or
    where no view is left that shows an object.
    """
    objects = [object_id] if object_id else [item.id for item in house.objects]
    names = [viewpoint] if viewpoint else list(house.graph.viewpoints)
    for name in objects:
        house.object(name)
    positions = house.graph.positions[[house.graph.row(name) for name in names]].tolist()
    cameras = [camera for x, y, z in positions for camera in panorama_cameras((x, y, z), 64, 48)]
    columns = [index for index, item in enumerate(house.objects) if item.id in objects]
    share = object_coverage(house, cameras, spp=1)[:, columns]
    if not share.any():
        raise InputError(
            file=house.name,
            field="object",
            expected="one that a view shows",
            received=f"{object_id or 'any'} at {viewpoint or 'any viewpoint'}",
        )
    row, column = np.unravel_index(int(share.argmax()), share.shape)
    return objects[column], View(names[row // VIEWS], int(row % VIEWS))
