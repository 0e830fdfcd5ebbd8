"""The fixed-illumination rung of a lit house, against Mitsuba's path tracer and its gradient."""

from functools import cache

import numpy as np
import pytest
import torch
from torch import Tensor

from tests.houses import cabinet_cameras, tiny_house
from vlnhijack.errors import InputError
from vlnhijack.rendering.fixed_illumination import FixedIlluminationRenderer
from vlnhijack.rendering.light import light_at
from vlnhijack.rendering.mitsuba_renderer import MitsubaRenderer
from vlnhijack.rendering.mitsuba_scene import shared_scene
from vlnhijack.rendering.observe import render_views
from vlnhijack.rendering.variant import activate

OBJECT = "cabinet_0"
SIZE = (16, 12)


@cache
def _renderer(seed: int = 3) -> FixedIlluminationRenderer:
    return FixedIlluminationRenderer(
        tiny_house("lit"), OBJECT, cabinet_cameras(*SIZE)[:2], 64, seed, light_spp=16
    )


def _texture() -> Tensor:
    return torch.from_numpy(tiny_house("lit").surface(OBJECT).texture)


def _gradient(renderer: FixedIlluminationRenderer | MitsubaRenderer) -> Tensor:
    texture = _texture().requires_grad_()
    return torch.autograd.grad(renderer(texture).mean(), texture)[0]


def test_at_its_own_texture_it_is_the_path_traced_picture() -> None:
    shown = _renderer()(_texture())
    expected = render_views(tiny_house("lit"), cabinet_cameras(*SIZE)[:2], 400, 9)
    assert float((shown - expected).mean().abs()) < 0.004
    assert float((shown - expected).abs().mean()) < 0.02


def test_rays_that_miss_the_object_are_those_of_the_views() -> None:
    renderer = _renderer()
    covered = renderer.transport(torch.ones(renderer.texture_shape)).view(2, -1, 3).sum(-1)
    shown = renderer(_texture()).flatten(2)
    views = render_views(tiny_house("lit"), cabinet_cameras(*SIZE)[:2], 64, 3).flatten(2)
    outside = (covered == 0)[:, None].expand_as(shown)
    assert outside.any() and not outside.all()
    torch.testing.assert_close(shown[outside], views[outside], atol=1e-5, rtol=0)


def test_the_image_follows_albedo_and_exposure_by_hand() -> None:
    """encode(exposure · (b + A·decode(t))), the bound ε being on t."""
    renderer, texture = _renderer(), _texture() * 0.5
    linear = torch.where(texture <= 0.04045, texture / 12.92, ((texture + 0.055) / 1.055) ** 2.4)
    radiance = (2.0 * (renderer.background + renderer.transport(linear))).clamp(0, 1)
    encoded = torch.where(
        radiance <= 0.0031308, 12.92 * radiance, 1.055 * radiance ** (1 / 2.4) - 0.055
    )
    expected = encoded.view(2, SIZE[1], SIZE[0], 3).permute(0, 3, 1, 2)
    torch.testing.assert_close(renderer(texture), expected, atol=1e-6, rtol=1e-5)


def test_its_gradient_is_near_that_of_mitsuba() -> None:
    """Biased by the light that the cabinet throws on itself and on the room, and no more."""
    mitsuba = MitsubaRenderer(tiny_house("lit"), OBJECT, cabinet_cameras(*SIZE)[:2], 400, 5)
    ours, full = _gradient(_renderer()), _gradient(mitsuba)
    assert float(torch.cosine_similarity(ours.ravel(), full.ravel(), 0)) > 0.9
    assert 0.8 < float(ours.sum() / full.sum()) < 1.05


def test_refreshing_renews_the_light_and_repeats_it() -> None:
    renderer = FixedIlluminationRenderer(
        tiny_house("lit"), OBJECT, cabinet_cameras(*SIZE)[:2], 4, 3
    )
    first, black = renderer(_texture()), torch.zeros(renderer.texture_shape)
    before = renderer.background.clone()
    renderer.refresh(black)
    assert float((before - renderer.background).mean()) > 1e-4
    renderer.refresh(_texture())
    assert torch.equal(renderer(_texture()), first)


def test_two_builds_are_bit_identical() -> None:
    first, second = (
        FixedIlluminationRenderer(tiny_house("lit"), OBJECT, cabinet_cameras(*SIZE)[:2], 4, 3)
        for _ in range(2)
    )
    assert torch.equal(first(_texture()), second(_texture()))


def test_light_below_a_lamp_is_its_irradiance() -> None:
    """Points of the cabinet's top: light times albedo is what the path tracer sees there."""
    mi = activate()
    house = tiny_house("lit").with_texture(OBJECT, np.ones((64, 64, 3), np.float32))
    scene = shared_scene(house).scene
    ray = mi.RayDifferential3f(mi.Point3f(0.2, 0.1, 2.0), mi.Vector3f(0, 0, -1))
    light = light_at(scene, scene.ray_intersect(ray), 20_000, 1)
    tracer = mi.load_dict({"type": "path", "max_depth": 6})
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(2, 20_000)
    rays = mi.RayDifferential3f(ray)
    rays.o += mi.Point3f(mi.Float(np.zeros(20_000)))
    radiance, _, _ = tracer.sample(scene, sampler, rays)
    expected = [np.array(channel).mean() for channel in radiance]
    np.testing.assert_allclose([np.array(x)[0] for x in light], expected, rtol=0.03)


def test_a_baked_house_is_refused() -> None:
    with pytest.raises(InputError, match="kind: expected lit"):
        FixedIlluminationRenderer(tiny_house(), OBJECT, cabinet_cameras(*SIZE)[:2])
