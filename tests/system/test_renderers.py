"""One suite for both renderers, and their parity: FrozenRenderer against Mitsuba's own `prb`."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import torch
from torch import Tensor

from tests.houses import cabinet_cameras, tiny_house
from vlnhijack.errors import InputError
from vlnhijack.frames import Camera
from vlnhijack.rendering.frozen_renderer import FrozenRenderer
from vlnhijack.rendering.mitsuba_renderer import MitsubaRenderer
from vlnhijack.rendering.observe import render_views
from vlnhijack.rendering.renderer import Renderer
from vlnhijack.scenes.house import Light

OBJECT = "cabinet_0"
SPP = 16
RENDERERS = {"frozen": FrozenRenderer, "mitsuba": MitsubaRenderer}


@cache
def _renderer(kind: str, seed: int = 7) -> Renderer:
    return RENDERERS[kind](tiny_house(), OBJECT, cabinet_cameras(64, 48), SPP, seed)


def _texture(seed: int = 0) -> Tensor:
    random = torch.Generator().manual_seed(seed)
    return torch.rand(tiny_house().surface(OBJECT).texture.shape, generator=random)


def _gradient(renderer: Renderer) -> Tensor:
    """Gradient of a fixed random weighting of the images."""
    texture = _texture().requires_grad_()
    image = renderer(texture)
    weights = torch.randn(image.shape, generator=torch.Generator().manual_seed(1))
    return torch.autograd.grad((image * weights).sum(), texture)[0]


def _cosine(a: Tensor, b: Tensor) -> float:
    return float(torch.nn.functional.cosine_similarity(a.ravel(), b.ravel(), 0))


def _mitsuba_gradient(gradient_seed: int) -> Tensor:
    renderer = MitsubaRenderer(tiny_house(), OBJECT, cabinet_cameras(64, 48), SPP, 12345)
    renderer.gradient_seed = gradient_seed
    return _gradient(renderer)


@pytest.mark.parametrize("kind", RENDERERS)
def test_shapes_and_range(kind: str) -> None:
    renderer = _renderer(kind)
    image = renderer(_texture())
    assert renderer.texture_shape == (64, 64, 3)
    assert image.shape == (4, 3, 48, 64)
    assert image.dtype == torch.float32
    assert image.min() >= 0
    assert image.max() <= 1 + 1e-5


@pytest.mark.parametrize("kind", RENDERERS)
def test_a_texture_of_another_shape_is_refused(kind: str) -> None:
    with pytest.raises(InputError, match=r"texture: expected \(64, 64, 3\), received \(64, 32"):
        _renderer(kind)(torch.zeros(64, 32, 3))


@pytest.mark.parametrize("kind", RENDERERS)
def test_images_equal_the_views_of_a_house_with_that_texture(kind: str) -> None:
    """At the same samples; so an attack sees what an evaluation of the same rays sees."""
    house = tiny_house().with_texture(OBJECT, _texture().numpy())
    views = render_views(house, cabinet_cameras(64, 48), SPP, 7)
    assert float((_renderer(kind)(_texture()) - views).abs().max()) <= 1e-5


@pytest.mark.parametrize("kind", RENDERERS)
def test_the_gradient_predicts_a_change_of_the_image(kind: str) -> None:
    """Exact for frozen; Mitsuba's gradient uses other rays than its image."""
    renderer = _renderer(kind)
    weights = torch.linspace(0, 1, 64)[None, None, None]
    texture, step = _texture(1).requires_grad_(), _texture(2) * 0.2
    before = (renderer(texture) * weights).mean()
    before.backward()
    after = (renderer(texture.detach() + step) * weights).mean()
    assert texture.grad is not None
    predicted = float((texture.grad * step).sum())
    tolerance = 1e-4 if kind == "frozen" else 0.02
    assert (after - before).item() == pytest.approx(predicted, rel=tolerance)


def test_same_samples_same_images_and_gradients() -> None:
    images = [_renderer(kind)(_texture()) for kind in RENDERERS]
    assert float((images[0] - images[1]).abs().max()) <= 1e-4
    frozen, mitsuba = _gradient(_renderer("frozen")), _mitsuba_gradient(7)
    assert _cosine(frozen, mitsuba) >= 0.9999
    assert float(frozen.norm() / mitsuba.norm()) == pytest.approx(1, abs=1e-3)


def test_other_samples_differ_no_more_than_two_mitsuba_seeds_do() -> None:
    seeds = (101, 102, 103)
    mitsuba = [_mitsuba_gradient(seed) for seed in seeds]
    frozen = [_gradient(_renderer("frozen", seed + 9)) for seed in seeds]
    between = np.mean([_cosine(mitsuba[i], mitsuba[j]) for i, j in ((0, 1), (1, 2), (0, 2))])
    across = np.mean([_cosine(f, m) for f in frozen for m in mitsuba])
    assert 0.9 < between < 0.9999
    assert 1 - across <= 1.1 * (1 - between)


def test_frozen_refuses_lit_houses() -> None:
    with pytest.raises(InputError, match="kind: expected baked"):
        FrozenRenderer(tiny_house("lit"), OBJECT, cabinet_cameras(64, 48))


def test_a_lit_house_gives_gradients_through_light_and_display() -> None:
    house, cameras = tiny_house("lit"), cabinet_cameras(32, 24)[:2]
    renderer = MitsubaRenderer(house, OBJECT, cameras, 64, 5, max_depth=3)
    texture = torch.full(renderer.texture_shape, 0.5, requires_grad=True)
    before = renderer(texture).mean()
    before.backward()
    assert texture.grad is not None
    predicted = 0.04 * float(texture.grad.sum())
    after = renderer(torch.full(renderer.texture_shape, 0.54)).mean()
    assert (after - before).item() == pytest.approx(predicted, rel=0.1)


def test_a_lit_house_is_shown_as_it_is_rendered() -> None:
    house, cameras = tiny_house("lit"), cabinet_cameras(32, 24)[:2]
    renderer = MitsubaRenderer(house, OBJECT, cameras, 144, 5)
    image = renderer(torch.from_numpy(house.surface(OBJECT).texture))
    views = render_views(house, cameras, 144, 6)
    assert float((image - views).mean().abs()) < 0.005
    darker = render_views(replace(house, exposure=house.exposure / 4), cameras, 144, 6)
    assert float(darker.mean()) < 0.7 * float(views.mean())


def test_a_lit_house_built_twice_renders_alike() -> None:
    """The order of the lamps decides the paths of a seed."""
    lit = tiny_house("lit")
    lamps = [
        Light((x, y, 2.45), (0.1, 0.0, 0.0), (0.0, -0.1, 0.0), (1.0 + x, 2.0 + y, 3.0))
        for x in (-0.9, -0.3, 0.3, 0.9)
        for y in (-1.0, 0.0, 1.0)
    ]
    cameras = [Camera((-1.2, -1.2, 1.5), 0.8, -0.4, 16, 12)]
    first, *others = (render_views(replace(lit, lights=tuple(lamps)), cameras) for _ in range(3))
    assert all(torch.equal(first, other) for other in others)
