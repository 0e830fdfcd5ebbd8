"""Every filter and wrap mode of the frozen operator, against Mitsuba's film and bitmap texture."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import torch

from tests.houses import tiny_house
from vlnhijack.agents.resize import resize_and_crop, resize_matrices
from vlnhijack.errors import InputError
from vlnhijack.frames import Camera, heading_of
from vlnhijack.rendering.filters import Filters
from vlnhijack.rendering.folded_renderer import FoldedRenderer
from vlnhijack.rendering.frozen_renderer import FrozenRenderer
from vlnhijack.rendering.mitsuba_renderer import MitsubaRenderer
from vlnhijack.scenes.house import House

OBJECT = "cabinet_0"


@cache
def _house() -> House:
    """The tiny house, the cabinet's uv stretched beyond its texture of 48 × 64 texels."""
    house = tiny_house()
    surface = house.surface(OBJECT)
    texture = np.ascontiguousarray(surface.texture[:48])
    changed = replace(surface, uv=surface.uv * np.float32(3.7) - np.float32(1.3), texture=texture)
    surfaces = tuple(changed if s is surface else s for s in house.surfaces)
    return replace(house, surfaces=surfaces)


def _cameras(width: int = 24, height: int = 18) -> list[Camera]:
    return [
        Camera((x, y, z), float(heading_of(-np.array((x, y)))), -0.4, width, height)
        for x, y, z in tiny_house().graph.positions[:2].tolist()
    ]


@pytest.mark.parametrize(
    "filters",
    [
        Filters("gaussian"),
        Filters("gaussian", "nearest", "repeat"),
        Filters("box", "nearest", "clamp"),
        Filters("box", "bilinear", "repeat"),
        Filters("box", "bilinear", "mirror"),
        Filters("box", "nearest", "mirror"),
    ],
    ids=str,
)
def test_frozen_is_mitsuba_at_the_same_rays(filters: Filters) -> None:
    frozen = FrozenRenderer(_house(), OBJECT, _cameras(), 16, 7, filters=filters)
    mitsuba = MitsubaRenderer(_house(), OBJECT, _cameras(), 16, 7, filters=filters)
    texture = torch.rand(frozen.texture_shape)
    torch.testing.assert_close(frozen(texture), mitsuba(texture), atol=1e-4, rtol=0)
    mitsuba.seed, mitsuba.gradient_seed = 8, 7
    texture.requires_grad_()
    images = [renderer(texture) for renderer in (frozen, mitsuba)]
    weights = torch.randn(images[0].shape)
    ours, theirs = (torch.autograd.grad(image, texture, weights)[0] for image in images)
    assert float((ours - theirs).norm() / theirs.norm()) <= 1e-3


def test_any_integrator_can_be_named() -> None:
    """`direct` sees the glow that `prb` of depth 1 sees."""
    direct = MitsubaRenderer(_house(), OBJECT, _cameras(), 4, 7, integrator={"type": "direct"})
    texture = torch.rand(direct.texture_shape)
    expected = MitsubaRenderer(_house(), OBJECT, _cameras(), 4, 7)(texture)
    assert float((direct(texture) - expected).abs().mean()) <= 0.02


def test_a_folded_resize_is_the_resized_picture() -> None:
    frozen = FrozenRenderer(tiny_house(), OBJECT, _cameras(40, 30), 4, 7)
    folded = FoldedRenderer(frozen, *resize_matrices((30, 40), (12, 12)), 2.0, -1.0)
    texture = torch.rand(frozen.texture_shape, requires_grad=True)
    images = [folded(texture), resize_and_crop(frozen(texture), (12, 12)) * 2 - 1]
    torch.testing.assert_close(*images, atol=1e-5, rtol=0)
    weights = torch.randn(images[0].shape)
    gradients = [torch.autograd.grad(image, texture, weights)[0] for image in images]
    assert float((gradients[0] - gradients[1]).abs().max()) <= 1e-4


def test_folding_is_refused_on_lit_houses_and_for_other_sizes() -> None:
    matrices = resize_matrices((18, 24), (9, 12))
    lit = MitsubaRenderer(tiny_house("lit"), OBJECT, _cameras(), 4)
    with pytest.raises(InputError, match="resizing folds into baked houses only"):
        FoldedRenderer(lit, *matrices)
    frozen = FrozenRenderer(tiny_house(), OBJECT, _cameras(40, 30), 4)
    with pytest.raises(InputError, match="expected 30 and 40 columns, received '18 and 24'"):
        FoldedRenderer(frozen, *matrices)
