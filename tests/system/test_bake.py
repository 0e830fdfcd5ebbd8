"""A baked house looks like the path-traced lit one."""

from dataclasses import replace

import numpy as np
import pytest

from tests.houses import tiny_house
from vlnhijack.experiments.views import house_cameras
from vlnhijack.frames import Camera
from vlnhijack.rendering.bake import bake
from vlnhijack.rendering.gather import Points, direct_light, reflected_light
from vlnhijack.rendering.mitsuba_scene import build_scene
from vlnhijack.rendering.observe import render_views
from vlnhijack.scenes.house import House, Light
from vlnhijack.scenes.house_files import load_house
from vlnhijack.scenes.surface import Surface
from vlnhijack.scenes.uv_atlas import used_texels
from vlnhijack.settings import house_folder


def _cameras() -> list[Camera]:
    positions = tiny_house().graph.positions[:2].tolist()
    return [Camera((x, y, z), h, -0.4, 32, 24) for x, y, z in positions for h in (0.6, 2.5, 5.4)]


def test_baked_views_equal_path_traced_views() -> None:
    lit = tiny_house("lit")
    baked = render_views(bake(lit), _cameras(), 16)
    traced = render_views(lit, _cameras(), 400)
    difference = (baked - traced).numpy()
    assert np.abs(difference).mean() < 0.012
    assert np.abs(difference.mean((0, 2, 3))).max() < 0.006
    assert traced.mean() > 0.15


def test_the_shipped_lit_house_is_as_bright_as_its_baked_one() -> None:
    houses = [load_house(house_folder(name)) for name in ("cedar", "cedar_lit")]
    brightness = [
        float(render_views(house, house_cameras(house.graph, 16, 12)[::24], spp).mean())
        for house, spp in zip(houses, (16, 256), strict=True)
    ]
    assert brightness[0] == pytest.approx(brightness[1], abs=0.02)
    assert 0.4 < brightness[0] < 0.6


def test_the_lamp_stays_visible() -> None:
    baked = bake(tiny_house("lit"), 4)
    assert baked.kind == "baked"
    assert baked.lights == ()
    up = Camera((0.0, 0.0, 1.5), 0.0, 1.5, 16, 12)
    assert float(render_views(baked, [up], 16)[0, :, 6, 8].min()) == pytest.approx(1)


def test_an_exposure_of_one_is_chosen_by_brightness() -> None:
    baked = bake(replace(tiny_house("lit"), exposure=1.0), 16)
    masks = [used_texels(s.uv, s.faces, *s.texture.shape[:2]) for s in baked.surfaces[:-1]]
    shown = zip(baked.surfaces, masks, strict=False)
    values = np.concatenate([surface.texture[mask] for surface, mask in shown])
    assert baked.exposure != 1
    assert values.mean() == pytest.approx(0.45, abs=0.01)


def test_baking_repeats_with_a_seed() -> None:
    first, again, other = (bake(tiny_house("lit"), 4, seed) for seed in (1, 1, 2))
    for a, b in zip(first.surfaces, again.surfaces, strict=True):
        np.testing.assert_array_equal(a.texture, b.texture)
    assert not np.array_equal(first.surfaces[0].texture, other.surfaces[0].texture)


def _ceiling(height: float) -> House:
    """Nothing but a plate of 2 × 2 m that glows downwards with radiance 1."""
    corners = np.float32([[-1, 1, height], [1, 1, height], [1, -1, height], [-1, -1, height]])
    faces, uv = np.array([[0, 1, 2], [0, 2, 3]], np.int32), np.zeros((4, 2), np.float32)
    plate = Surface("ceiling", corners, faces, uv, np.ones((2, 2, 3), np.float32))
    return replace(tiny_house(), surfaces=(plate,), objects=())


def _form_factor(height: float) -> float:
    """Of a square of half-width 1 seen from a parallel element below its centre (Howell C-11)."""
    side = 1 / height
    root = np.sqrt(1 + side**2)
    return float(4 / np.pi * side / root * np.arctan(side / root))


def test_gathered_light_is_the_form_factor() -> None:
    """Both ways, as a lamp and as a glowing surface; a point that looks away gets none."""
    normals = np.float32([[0, 0, 1], [0, 0, -1]])
    points = Points(np.zeros((2, 3), np.float32), normals)
    lamp = Light((0.0, 0.0, 1.5), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (1.0, 1.0, 1.0))
    ceiling, random = build_scene(_ceiling(1.5)), np.random.default_rng(0)
    empty = build_scene(_ceiling(-9.0))
    direct = np.mean([direct_light(empty, [lamp], points, random) for _ in range(200)], 0)
    reflected, backs = reflected_light(ceiling, points, 20_000, random)
    for light in (direct, reflected):
        np.testing.assert_allclose(light[0], _form_factor(1.5), rtol=0.01)
        np.testing.assert_array_equal(light[1], 0)
    assert backs.max() == 0


def test_backs_of_surfaces_are_counted() -> None:
    """Below the ceiling its front is seen; from above, its back."""
    points = Points(np.float32([[0, 0, 2], [0, 0, 1]]), np.float32([[0, 0, -1], [0, 0, 1]]))
    _, backs = reflected_light(build_scene(_ceiling(1.5)), points, 1000, np.random.default_rng(0))
    assert backs[0] > 0.7
    assert backs[1] == 0
