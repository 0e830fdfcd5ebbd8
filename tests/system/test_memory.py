"""Memory of the renderers: bounded while building, constant over many iterations."""

from collections.abc import Callable

import pytest
import torch

from tests.houses import tiny_house
from vlnhijack.frames import Camera
from vlnhijack.rendering.frozen_renderer import FrozenRenderer
from vlnhijack.rendering.memory import restart_peak
from vlnhijack.rendering.mitsuba_renderer import MitsubaRenderer
from vlnhijack.rendering.renderer import Renderer

CAMERAS = [Camera((-1.2, -1.2, 1.5), 0.785, -0.4, 64, 48)]
WARM_UP, ITERATIONS = 200, 2000
LARGEST_GROWTH = 10.0


@pytest.mark.slow
@pytest.mark.parametrize("make", [FrozenRenderer, MitsubaRenderer])
def test_iterations_do_not_grow(make: Callable[..., Renderer]) -> None:
    """Resident megabytes over 2,000 images with gradients, after warm-up."""
    renderer = make(tiny_house(), "cabinet_0", CAMERAS, 4)
    texture = torch.rand(renderer.texture_shape, requires_grad=True)

    def iterate(times: int) -> float:
        for _ in range(times):
            torch.autograd.grad(renderer(texture).sum(), texture)
        return restart_peak()

    before = iterate(WARM_UP)
    assert iterate(ITERATIONS) - before <= LARGEST_GROWTH
