"""Images and gradients of two renderers side by side."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import torch
from torch import Tensor

from tests.ray_twin import Twin
from vlnhijack.frames import Camera
from vlnhijack.rendering.mitsuba_renderer import MitsubaRenderer
from vlnhijack.scenes.house import House

Render = Callable[[Tensor], Tensor]


class Rendered(NamedTuple):
    """Images (V,3,h,w), and the gradient (H,W,3) of a random weighting of them."""

    image: Tensor
    gradient: Tensor


class Errors(NamedTuple):
    """The largest difference of a pixel; of the gradient 1 − cosine, |norm ratio − 1| and the
    mean difference over the mean size. They are huge for a gradient that ought to be zero."""

    image: float
    cosine: float
    norm: float
    bias: float


def random_texture(shape: Sequence[int], seed: int = 0) -> Tensor:
    return torch.rand(tuple(shape), generator=torch.Generator().manual_seed(seed))


def rendered(render: Render, texture: Tensor) -> Rendered:
    texture = texture.clone().requires_grad_()
    image = render(texture)
    (gradient,) = torch.autograd.grad((image * image_weights(image.shape)).sum(), texture)
    return Rendered(image.detach(), gradient)


def image_weights(shape: Sequence[int]) -> Tensor:
    """The fixed random weighting (V,3,h,w) whose gradient `rendered` takes."""
    return torch.randn(tuple(shape), generator=torch.Generator().manual_seed(1))


def rendered_by_mitsuba(
    house: House, object_id: str, cameras: Sequence[Camera], spp: int, seed: int, texture: Tensor
) -> Rendered:
    """Image and gradient at the same camera rays, which Mitsuba refuses within one call."""
    renderer = MitsubaRenderer(house, object_id, cameras, spp, seed)
    image = renderer(texture)
    renderer.seed, renderer.gradient_seed = seed + 1, seed
    return Rendered(image, rendered(renderer, texture).gradient)


def rendered_by_twin(twin: Twin, texture: Tensor) -> Rendered:
    """The same in float64."""
    image = torch.from_numpy(twin.image(texture.double().numpy()))
    weights = image_weights(image.shape).double().numpy()
    return Rendered(image, torch.from_numpy(twin.gradient(weights)))


def errors(found: Rendered, true: Rendered) -> Errors:
    gradient, expected = (x.gradient.double().ravel() for x in (found, true))
    tiny = 1e-12
    size, length = (max(float(x.norm()), tiny) for x in (expected, gradient))
    alike = float(gradient @ expected) / size / length
    return Errors(
        float((found.image - true.image).abs().max()),
        1 - alike if gradient.any() or expected.any() else 0.0,
        abs(length / size - 1),
        abs(float((gradient - expected).sum())) / max(float(expected.abs().sum()), tiny),
    )
