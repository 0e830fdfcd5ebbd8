"""Hard cases: frozen against Mitsuba's own `prb` and a float64 twin, at the same camera rays.

Each case is a scene, the proof that it is as hard as its name, bounds, and ways to break the fast
path that its bounds must notice.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
import torch
from torch import Tensor

from tests import hard_scenes as scenes
from tests.broken import BREAK
from tests.hard_scenes import HEIGHT, TARGET, WIDTH, Scene
from tests.houses import tiny_house
from tests.parity import (
    Errors,
    Rendered,
    errors,
    random_texture,
    rendered,
    rendered_by_mitsuba,
    rendered_by_twin,
)
from tests.ray_twin import Twin
from vlnhijack.frames import Camera
from vlnhijack.rendering.frozen_renderer import FrozenRenderer
from vlnhijack.rendering.mitsuba_renderer import MitsubaRenderer
from vlnhijack.rendering.observe import render_views
from vlnhijack.scenes.surface import Surface

SEED = 7


@dataclass(frozen=True, eq=False)
class Case:
    """A scene, whether it is hard, ways to break frozen that are noticed, and bounds on its errors.

    texture is the value of all texels, None for random ones. The twin is no referee where rounding
    decides which of two faces a ray meets.
    """

    name: str
    build: Callable[[], Scene]
    is_hard: Callable[[Twin], object]
    broken: tuple[str, ...] = ("half a texel off", "a ray lost")
    texture: float | None = None
    spp: int = 4
    bounds: Errors = Errors(image=2e-5, cosine=1e-9, norm=1e-5, bias=1e-5)
    has_twin: bool = True


def _texels_a_pixel(twin: Twin) -> np.ndarray:
    """Width and height of a pixel in texels, of a board that fills one straight view."""
    height, width, _ = _target(twin).texture.shape
    return np.ptp(twin.hits.uv, axis=0) * (width / WIDTH, height / HEIGHT)


def _target(twin: Twin) -> Surface:
    return twin.house.surface(TARGET)


def _areas(surface: Surface) -> np.ndarray:
    a, b, c = surface.vertices[surface.faces].astype(np.float64).transpose(1, 0, 2)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def _is_degenerate(twin: Twin) -> bool:
    areas = _areas(_target(twin))
    return (areas == 0).sum() == 3 and 0 < areas[areas > 0].min() < 1e-6


def _is_loose(twin: Twin) -> bool:
    surface = _target(twin)
    unused = np.setdiff1d(np.arange(len(surface.vertices)), surface.faces)
    return len(unused) > 0 and len(np.unique(surface.vertices, axis=0)) < len(surface.vertices)


CASES = [
    Case("camera 1 cm from a surface", scenes.near_surface,
        lambda twin: twin.hits.distance.min() < 0.0101),
    Case("camera inside a closed object", scenes.inside_object,
        lambda twin: (twin.per_view(twin.hits.cosine)[0] < 0).all(),
        broken=("half a texel off", "faces turned round")),
    Case("object across the near plane", scenes.across_near_plane,
        lambda twin: np.ptp(_target(twin).vertices[:, 1]) > 3 and twin.hits.distance.min() < 0.01),
    Case("grazing view at 89.9°", scenes.grazing,
        lambda twin: abs(np.rad2deg(np.arccos(twin.hits.cosine[twin.seen])) - 89.9).max() < 0.02),
    Case("object smaller than a pixel", scenes.sub_pixel,
        lambda twin: 0 < twin.per_view(twin.seen).mean(3).sum((1, 2)).max() < 1, spp=16),
    Case("object behind a chair's bars", scenes.behind_bars,
        lambda twin: np.diff(twin.per_view(twin.seen)[0, HEIGHT // 2, :, 0]).sum() >= 10,
        broken=("half a texel off", "occluders ignored", "background taken for the object")),
    Case("coincident faces", scenes.coincident_faces,
        lambda twin: (twin.hits.layers > 1).mean() > 0.05,
        broken=("half a texel off", "occluders ignored"), has_twin=False),
    Case("zero-area and sliver triangles", scenes.degenerate_faces, _is_degenerate),
    Case("unreferenced and duplicated vertices", scenes.loose_vertices, _is_loose),
    Case("chart seams and charts one texel wide", scenes.narrow_charts,
        lambda twin: (np.ptp(_target(twin).uv[_target(twin).faces, 0], 1) * 8 == 1).all(),
        broken=("half a texel off", "nearest texel")),
    Case("texture 16 times finer than the pixels", scenes.fine_texture,
        lambda twin: _texels_a_pixel(twin).min() >= 16,
        broken=("half a texel off", "other rays"),
        bounds=Errors(image=1e-4, cosine=1e-8, norm=1e-5, bias=1e-5)),
    Case("texture 16 times coarser than the pixels", scenes.coarse_texture,
        lambda twin: _texels_a_pixel(twin).max() <= 1 / 16,
        broken=("half a texel off", "nearest texel")),
    Case("mirrored and rotated uv", scenes.turned_uv,
        lambda twin: len(_target(twin).faces) == 8,
        broken=("half a texel off", "u and v swapped")),
    Case("uv outside [0,1]", scenes.uv_outside,
        lambda twin: (abs(twin.hits.uv[twin.seen] - 0.5).max(1) > 0.5).mean() > 0.5,
        broken=("half a texel off", "repeated, not clamped")),
    Case("texture wider than high", scenes.wide_texture,
        lambda twin: _target(twin).texture.shape == (5, 40, 3),
        broken=("half a texel off", "u and v swapped")),
    Case("texture higher than wide", scenes.tall_texture,
        lambda twin: _target(twin).texture.shape == (40, 5, 3),
        broken=("half a texel off", "u and v swapped")),
    Case("texture of one column", scenes.one_column,
        lambda twin: _target(twin).texture.shape == (16, 1, 3)),
    Case("texture of one texel", scenes.one_texel,
        lambda twin: _target(twin).texture.shape == (1, 1, 3),
        broken=("a ray lost", "background taken for the object")),
    Case("10 km from the origin", scenes.far_away,
        lambda twin: np.linalg.norm(_target(twin).vertices, axis=1).min() > 9990),
    Case("black texture", scenes.plain, lambda twin: twin.seen.any(),
        broken=("no gradient at the clamp", "half a texel off"), texture=0.0),
    Case("white texture", scenes.plain, lambda twin: twin.seen.any(),
        broken=("no gradient at the clamp", "half a texel off", "a ray lost"), texture=1.0),
    Case("object in no view", scenes.in_no_view, lambda twin: not twin.seen.any(),
        broken=("background taken for the object",)),
]  # fmt: skip


@cache
def _scene(case: Case) -> Scene:
    return case.build()


def _texture(case: Case) -> Tensor:
    shape = _scene(case).house.surface(TARGET).texture.shape
    return random_texture(shape) if case.texture is None else torch.full(shape, case.texture)


@cache
def _twin(case: Case) -> Twin:
    house, cameras = _scene(case)
    return Twin(house, TARGET, cameras, case.spp, SEED)


@cache
def _by_frozen(case: Case) -> Rendered:
    house, cameras = _scene(case)
    return rendered(FrozenRenderer(house, TARGET, cameras, case.spp, SEED), _texture(case))


@cache
def _by_mitsuba(case: Case) -> Rendered:
    house, cameras = _scene(case)
    return rendered_by_mitsuba(house, TARGET, cameras, case.spp, SEED, _texture(case))


def _exceeded(found: Rendered, true: Rendered, bounds: Errors) -> dict[str, float]:
    """The errors that exceed their bounds."""
    return {
        name: error
        for name, error in errors(found, true)._asdict().items()
        if not error <= getattr(bounds, name)
    }


each = pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)


@each
def test_the_scene_is_as_hard_as_its_name(case: Case) -> None:
    assert case.is_hard(_twin(case))


@each
def test_frozen_equals_mitsuba(case: Case) -> None:
    frozen, mitsuba = _by_frozen(case), _by_mitsuba(case)
    assert all(values.isfinite().all() for values in (*frozen, *mitsuba))
    assert not _exceeded(frozen, mitsuba, case.bounds)


@pytest.mark.parametrize(
    "case", [case for case in CASES if case.has_twin], ids=lambda case: case.name
)
def test_frozen_equals_its_twin(case: Case) -> None:
    twin = rendered_by_twin(_twin(case), _texture(case))
    assert not _exceeded(_by_frozen(case), twin, case.bounds)


@pytest.mark.parametrize(
    ("case", "way"),
    [(case, way) for case in CASES for way in case.broken],
    ids=lambda value: getattr(value, "name", value),
)
def test_a_broken_fast_path_is_noticed(case: Case, way: str) -> None:
    found = rendered(BREAK[way](_scene(case), case.spp, SEED), _texture(case))
    assert _exceeded(found, _by_mitsuba(case), case.bounds)


def test_10_km_from_the_origin_it_looks_as_at_the_origin() -> None:
    """But for the camera's position, which float32 rounds to half a millimetre there."""
    here, there = (render_views(*build(), 16, SEED) for build in (scenes.plain, scenes.far_away))
    assert float((here - there).abs().mean()) < 0.002


@pytest.mark.parametrize("value", [0.0, 1.0])
def test_lit_gradients_are_finite_at_the_clamp(value: float) -> None:
    """Also in the dark: the second camera stands in the object."""
    cameras = [Camera((-1.2, -1.2, 1.5), 0.8, -0.4, 32, 24), Camera((0, 0, 0.45), 0, 0, 32, 24)]
    renderer = MitsubaRenderer(tiny_house("lit"), "cabinet_0", cameras, 4, SEED, max_depth=3)
    texture = torch.full(renderer.texture_shape, value, requires_grad=True)
    image = renderer(texture)
    (gradient,) = torch.autograd.grad(image.sum(), texture)
    assert image.isfinite().all()
    assert gradient.isfinite().all()
    assert gradient.max() > 0
    assert not image[1].any()
