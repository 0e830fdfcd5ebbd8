"""Laws of rendering that hold for every scene, and the bounds on gradients and memory."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import torch
from torch import Tensor

from tests import hard_scenes
from tests.hard_scenes import TARGET, Scene
from tests.houses import cabinet_cameras, tiny_house
from tests.parity import (
    Render,
    random_texture,
    rendered,
    rendered_by_mitsuba,
    rendered_by_twin,
)
from tests.ray_twin import Twin
from vlnhijack.rendering import samples
from vlnhijack.rendering.coverage import object_coverage
from vlnhijack.rendering.frozen_renderer import FrozenRenderer
from vlnhijack.rendering.memory import restart_peak
from vlnhijack.rendering.mitsuba_renderer import MitsubaRenderer
from vlnhijack.rendering.observe import render_views
from vlnhijack.scenes.house import House

OBJECT = "cabinet_0"
SHAPE = (64, 64, 3)
SPP, SEED = 4, 3
RENDERERS = {"frozen": FrozenRenderer, "mitsuba": MitsubaRenderer}

both = pytest.mark.parametrize("kind", RENDERERS)


@cache
def _renderer(kind: str) -> Render:
    return RENDERERS[kind](tiny_house(), OBJECT, cabinet_cameras(), SPP, SEED)


def _white(house: House) -> House:
    surfaces = (s.with_texture(np.ones_like(s.texture)) for s in house.surfaces)
    return replace(house, surfaces=tuple(surfaces))


def _object_light(render: Render, texture: Tensor) -> Tensor:
    """A·t: the image without the background's share, float64."""
    with torch.no_grad():
        return render(texture).double() - render(torch.zeros_like(texture)).double()


@both
def test_energy_a_white_house_is_white_inside(kind: str) -> None:
    """Every ray from a viewpoint meets the front of a face."""
    house = _white(tiny_house())
    image = RENDERERS[kind](house, OBJECT, cabinet_cameras(), SPP, SEED)(torch.ones(SHAPE))
    torch.testing.assert_close(image, torch.ones_like(image), atol=2e-6, rtol=0)
    views = render_views(house, cabinet_cameras(), SPP, SEED)
    torch.testing.assert_close(views, torch.ones_like(views), atol=2e-6, rtol=0)


@both
def test_energy_only_fronts_are_white(kind: str) -> None:
    """In a closed box and before it: as much light as the twin finds fronts."""
    house, cameras = hard_scenes.inside_object()
    white = torch.ones(house.surface(TARGET).texture.shape)
    image = RENDERERS[kind](_white(house), TARGET, cameras, SPP, SEED)(white)
    twin = torch.from_numpy(Twin(_white(house), TARGET, cameras, SPP, SEED).image(white.numpy()))
    assert twin[0].max() == 0 < twin[1].max()
    torch.testing.assert_close(image.double(), twin, atol=2e-6, rtol=0)


@both
def test_the_object_is_linear_in_its_texture(kind: str) -> None:
    """A(αs + βt) = αAs + βAt, also far outside [0,1]."""
    s, t = (random_texture(SHAPE, seed) for seed in (1, 2))
    light_s, light_t = (_object_light(_renderer(kind), x) for x in (s, t))
    mixed = _object_light(_renderer(kind), -1.7 * s + 2.3 * t)
    torch.testing.assert_close(mixed, -1.7 * light_s + 2.3 * light_t, atol=5e-6, rtol=0)


@both
def test_the_gradient_is_the_adjoint(kind: str) -> None:
    """⟨Ax, y⟩ = ⟨x, Aᵀy⟩ within 1e-6, Mitsuba's at equal rays for both."""
    texture, cameras = random_texture(SHAPE, 4), cabinet_cameras()
    weights = random_texture((len(cameras), 3, 24, 32), 5)
    forward = (_object_light(_renderer(kind), texture) * weights).sum()
    renderer = RENDERERS[kind](tiny_house(), OBJECT, cameras, SPP, SEED)
    if isinstance(renderer, MitsubaRenderer):
        renderer.seed, renderer.gradient_seed = SEED + 1, SEED
    leaf = texture.clone().requires_grad_()
    (gradient,) = torch.autograd.grad((renderer(leaf) * weights).sum(), leaf)
    backward = (texture.double() * gradient.double()).sum()
    torch.testing.assert_close(forward, backward, rtol=1e-6, atol=0)


@pytest.mark.parametrize(
    "scene",
    [hard_scenes.behind_bars(), hard_scenes.coincident_faces(), hard_scenes.in_no_view()],
    ids=["bars", "coincident", "no view"],
)
def test_rows_sum_to_the_coverage_of_the_object(scene: Scene) -> None:
    house, cameras = scene
    frozen = FrozenRenderer(house, TARGET, cameras, SPP, SEED)
    rows = _object_light(frozen, torch.ones(frozen.texture_shape))
    coverage = object_coverage(house, cameras, SPP, SEED)[:, 0]
    np.testing.assert_allclose(rows[:, 0].mean((1, 2)), coverage, atol=1e-6)
    whole = (rows * SPP).round() / SPP
    torch.testing.assert_close(rows, whole, atol=2e-6, rtol=0)


@both
def test_tiles_of_views_change_the_samples_alone(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Three views in wavefronts of two differ from one wavefront as two seeds do, in any order."""
    cameras, texture = cabinet_cameras(64, 48)[:3], random_texture(SHAPE)

    def images(renderer: str, seed: int) -> Tensor:
        return RENDERERS[renderer](tiny_house(), OBJECT, cameras, SPP, seed)(texture)

    whole, other = images(kind, 5), images(kind, 6)
    monkeypatch.setattr(samples, "RAYS_AT_ONCE", 2 * 64 * 48 * SPP)
    tiled = images(kind, 5)
    assert tiled.shape == whole.shape
    assert (tiled - whole).abs().mean() <= 1.1 * (other - whole).abs().mean()
    assert (tiled - whole).mean().abs() <= 4 * (other - whole).std() / whole[:, 0].numel() ** 0.5
    torch.testing.assert_close(tiled, images("mitsuba", 5), atol=1e-5, rtol=0)


def test_frozen_repeats_bit_for_bit() -> None:
    """Build, apply and adjoint."""
    first, again, other = (
        rendered(
            FrozenRenderer(tiny_house(), OBJECT, cabinet_cameras(), SPP, seed),
            random_texture(SHAPE),
        )
        for seed in (SEED, SEED, SEED + 1)
    )
    assert all(torch.equal(a, b) for a, b in zip(first, again, strict=True))
    assert not torch.equal(first.image, other.image)


def test_mitsubas_gradients_repeat_within_rounding() -> None:
    first, again = (
        rendered_by_mitsuba(
            tiny_house(), OBJECT, cabinet_cameras(), SPP, SEED, random_texture(SHAPE)
        )
        for _ in range(2)
    )
    assert (first.gradient - again.gradient).norm() <= 1e-5 * first.gradient.norm()


@pytest.mark.parametrize(
    "scene",
    [hard_scenes.narrow_charts(), hard_scenes.uv_outside(), hard_scenes.coarse_texture()],
    ids=["charts", "outside", "coarse"],
)
def test_the_operators_gradient_is_that_of_its_float64_twin(scene: Scene) -> None:
    """Within 1e-6, where texels are so few that float32 places a hit within 1e-6 of one."""
    house, cameras = scene
    texture = random_texture(house.surface(TARGET).texture.shape)
    found = rendered(FrozenRenderer(house, TARGET, cameras, SPP, SEED), texture).gradient
    true = rendered_by_twin(Twin(house, TARGET, cameras, SPP, SEED), texture).gradient
    assert (found - true).norm() <= 1e-6 * true.norm()


def test_baked_mitsuba_gradients_are_central_differences() -> None:
    renderer = MitsubaRenderer(tiny_house(), OBJECT, cabinet_cameras(), SPP, SEED)
    texture, step = random_texture(SHAPE), 0.1 * random_texture(SHAPE, 1)
    weights = torch.linspace(0, 1, 32)

    def total(values: Tensor) -> Tensor:
        return (renderer(values) * weights).sum()

    with torch.no_grad():
        difference = (total(texture + step) - total(texture - step)) / 2
    renderer.seed, renderer.gradient_seed = SEED + 1, SEED
    leaf = texture.requires_grad_()
    (gradient,) = torch.autograd.grad(total(leaf), leaf)
    torch.testing.assert_close((gradient * step).sum(), difference, rtol=1e-3, atol=0)


def test_lit_mitsuba_gradients_are_central_differences() -> None:
    """A Z-test over independent seeds, p > 0.1 %, that would notice 5 %.

    An exposure on the straight part of the display curve keeps both estimates free of bias.
    """
    house = replace(tiny_house("lit"), exposure=2e-4)
    renderer = MitsubaRenderer(house, OBJECT, cabinet_cameras(16, 12), 36, max_depth=3)
    texture, step, pairs = 0.1 + 0.8 * random_texture(SHAPE), 0.02, []
    for seed in range(8):
        renderer.seed, renderer.gradient_seed = 100 + seed, 200 + seed
        with torch.no_grad():
            up, down = (renderer(texture + sign * step).mean() for sign in (1, -1))
        leaf = texture.clone().requires_grad_()
        (gradient,) = torch.autograd.grad(renderer(leaf).mean(), leaf)
        pairs.append((float(up - down) / (2 * step), float(gradient.sum())))
    differences, gradients = np.array(pairs).T
    error = np.hypot(differences.std(ddof=1), gradients.std(ddof=1)) / np.sqrt(len(pairs))
    assert abs(differences.mean() - gradients.mean()) < 3.3 * error
    assert 3.3 * error < 0.05 * abs(differences.mean())


@pytest.mark.slow
@both
def test_memory_does_not_grow(kind: str) -> None:
    """Resident memory over 2,000 forward and backward passes at 64×48, after a warm-up."""
    renderer = RENDERERS[kind](tiny_house(), OBJECT, cabinet_cameras(64, 48)[:1], SPP, SEED)
    texture = random_texture(SHAPE).requires_grad_()

    def iterate(times: int) -> float:
        for _ in range(times):
            renderer(texture).mean().backward()
        return restart_peak()

    before = iterate(200)
    assert iterate(2000) - before <= 10
