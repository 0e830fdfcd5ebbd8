"""Stock Mitsuba loads and renders scene.xml, and the picture is the one the conventions promise."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from tests.houses import tiny_house
from vlnhijack import display, frames
from vlnhijack.rendering.variant import activate
from vlnhijack.scenes.house import House, Light
from vlnhijack.scenes.house_files import save_house
from vlnhijack.scenes.mitsuba_xml import default_camera
from vlnhijack.scenes.surface import Surface

FACES = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
UV = np.array([[0, 0], [0, 1], [1, 1], [1, 0]], np.float32)


def _render(house: House, folder: Path, spp: int) -> np.ndarray:
    mi = activate()
    save_house(house, folder)
    return np.array(mi.render(mi.load_file(str(folder / "scene.xml"), parallel=False), spp=spp))


def _bare(house: House, corners: list[list[float]], texture: np.ndarray, **changes: Any) -> House:
    """The house with nothing in it but one rectangle: corners in the order of UV."""
    surface = Surface("plate", np.array(corners, np.float32), FACES, UV, texture)
    return replace(house, surfaces=(surface,), objects=(), **changes)


def test_uv_zero_is_the_first_row_and_samples_lie_at_half_texels(tmp_path: Path) -> None:
    """A wall straight ahead shows its texture upright: u to the right, v down."""
    texture = display.from_8bit(
        np.random.default_rng(0).integers(0, 256, (5, 7, 3), dtype=np.uint8)
    )
    wall = [[-4.0, 2.0, 3.0], [-4.0, 2.0, -3.0], [4.0, 2.0, -3.0], [4.0, 2.0, 3.0]]
    house = _bare(tiny_house(), wall, texture)
    camera = default_camera(house)
    image = _render(house, tmp_path / "house", 64)
    rows, columns = (np.mgrid[:480:8, :640:8] + 0.5).reshape(2, -1)
    scale = 2 * np.tan(camera.vertical_fov / 2) / camera.height
    rays = np.stack([(320 - columns) * scale, (240 - rows) * scale, np.ones_like(rows)], 1)
    rays = rays @ frames.camera_to_world(camera)[:3, :3].T
    position = np.array(camera.position)
    hits = position + rays * ((2.0 - position[1]) / rays[:, 1:2])
    u, v = (hits[:, 0] + 4) / 8, (3 - hits[:, 2]) / 6
    on_wall = (np.abs(u - 0.5) < 0.49) & (np.abs(v - 0.5) < 0.49) & (rays[:, 1] > 0)
    assert on_wall.sum() > 500
    where = np.stack([v[on_wall] * 5 - 0.5, u[on_wall] * 7 - 0.5])
    expected = np.stack(
        [map_coordinates(texture[..., c], where, order=1, mode="nearest") for c in range(3)], 1
    )
    seen = image[rows[on_wall].astype(int), columns[on_wall].astype(int)]
    assert np.abs(seen - expected).mean() < 0.002
    assert np.abs(seen - expected).max() < 0.03


def test_a_baked_room_is_seen_from_inside_without_light_or_holes(tmp_path: Path) -> None:
    house = tiny_house()
    image = _render(house, tmp_path / "house", 4)
    assert image.shape == (480, 640, 3)
    low = min(s.texture.min() for s in house.surfaces)
    high = max(s.texture.max() for s in house.surfaces)
    assert low - 1e-4 <= image.min() and image.max() <= high + 1e-4


@pytest.mark.parametrize("up", [False, True])
def test_a_light_shines_along_half_u_cross_half_v_on_srgb_albedo(tmp_path: Path, up: bool) -> None:
    floor = [[-3.0, 3.0, 0.0], [-3.0, -3.0, 0.0], [3.0, -3.0, 0.0], [3.0, 3.0, 0.0]]
    half_v = (0.0, 0.5, 0.0) if up else (0.0, -0.5, 0.0)
    light = Light((0.0, 0.0, 4.0), (0.5, 0.0, 0.0), half_v, (9.0, 9.0, 9.0))
    means = []
    for level in (0.5, 1.0):
        texture = np.full((2, 2, 3), np.round(level * 255) / 255, np.float32)
        house = _bare(tiny_house("lit"), floor, texture, lights=(light,))
        means.append(float(_render(house, tmp_path / "house", 16)[300:].mean()))
    if up:
        assert means == [0, 0]
    else:
        assert means[0] / means[1] == pytest.approx(display.decode(128 / 255), rel=0.01)
