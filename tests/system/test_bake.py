"""A baked house looks like the path-traced lit one."""

from dataclasses import replace

import numpy as np
import pytest

from tests.houses import tiny_house
from vlnhijack.frames import Camera
from vlnhijack.rendering.bake import bake
from vlnhijack.rendering.observe import render_views
from vlnhijack.scenes.uv_atlas import used_texels


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
