"""Views, coverage and depth of a house: against stock Mitsuba, geometry and each other."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from tests.houses import ROOM, tiny_house
from vlnhijack.errors import InputError
from vlnhijack.frames import Camera, direction, heading_of
from vlnhijack.rendering import samples
from vlnhijack.rendering.coverage import depth_map, object_coverage, object_index_map
from vlnhijack.rendering.frozen_renderer import FrozenRenderer
from vlnhijack.rendering.observe import render_views
from vlnhijack.rendering.variant import activate
from vlnhijack.scenes.house_files import load_house, save_house
from vlnhijack.scenes.mitsuba_xml import default_camera


def _towards(point: tuple[float, float, float], width: int = 64, height: int = 48) -> list[Camera]:
    """Cameras at the tiny house's viewpoints that look at a point."""
    return [
        Camera((x, y, z), float(heading_of(np.subtract(point, (x, y, z)))), -0.4, width, height)
        for x, y, z in tiny_house().graph.positions.tolist()
    ]


@pytest.mark.parametrize("kind", ["baked", "lit"])
def test_stock_mitsuba_renders_the_exported_scene_alike(kind: str, tmp_path: Path) -> None:
    mi = activate()
    house = replace(tiny_house("lit" if kind == "lit" else "baked"), exposure=1.0)
    save_house(house, tmp_path / "house")
    scene = mi.load_file(str(tmp_path / "house" / "scene.xml"), parallel=False)
    stock = np.array(mi.render(scene, spp=16)).clip(0, 1).reshape(48, 10, 64, 10, 3).mean((1, 3))
    camera = replace(default_camera(house), width=64, height=48)
    ours = render_views(load_house(tmp_path / "house"), [camera], 256 if kind == "baked" else 1024)
    if kind == "lit":
        ours = torch.where(ours <= 0.04045, ours / 12.92, ((ours + 0.055) / 1.055) ** 2.4)
    difference = ours[0].permute(1, 2, 0).numpy() - stock
    assert np.abs(difference).mean() < (0.002 if kind == "baked" else 0.01)
    assert np.abs(difference.mean((0, 1))).max() < 0.002


def test_east_is_on_the_right_and_up_is_up() -> None:
    """A camera that looks north, slightly down, at two boxes, the farther one to the east."""
    house = tiny_house()
    colours = {"cabinet_0": (1.0, 0.0, 0.0), "table_0": (0.0, 1.0, 0.0)}
    for name, colour in colours.items():
        painted = np.broadcast_to(np.float32(colour), house.surface(name).texture.shape)
        house = house.with_texture(name, painted)
    camera = Camera((0.4, -2.0, 1.5), 0.0, -0.3, 64, 48)
    image = render_views(house, [camera], 16)[0]
    cabinet, table = image[0] - image[1] > 0.9, image[1] - image[0] > 0.9
    assert cabinet.any()
    assert table.any()
    centre = [float(torch.where(mask)[1].float().mean()) for mask in (cabinet, table)]
    assert centre[0] < 32 < centre[1]
    row = [float(torch.where(mask)[0].float().mean()) for mask in (cabinet, table)]
    assert row[1] < row[0]


def test_views_repeat_with_a_seed_and_differ_without() -> None:
    cameras = _towards((0.0, 0.0, 0.45))
    first, again, other = (render_views(tiny_house(), cameras, 4, seed) for seed in (1, 1, 2))
    assert torch.equal(first, again)
    assert not torch.equal(first, other)


def test_runs_of_cameras_keep_their_order(monkeypatch: pytest.MonkeyPatch) -> None:
    cameras = _towards((0.0, 0.0, 0.45)) + _towards((1.9, 1.9, 0.3))[:3]
    whole = render_views(tiny_house(), cameras, 64)
    monkeypatch.setattr(samples, "RAYS_AT_ONCE", 2 * 64 * 48 * 64)
    parts = render_views(tiny_house(), cameras, 64)
    assert parts.shape == whole.shape
    assert float((parts - whole).abs().mean()) < 0.005
    assert float((parts - whole.roll(1, 0)).abs().mean()) > 0.05


def test_the_inside_of_an_object_is_no_part_of_it() -> None:
    """Area emitters are one-sided: a camera in the cabinet sees black, not its texture."""
    house, inside = tiny_house(), [Camera((0.0, 0.0, 0.45), 0.3, 0.0, 16, 12)]
    assert object_coverage(house, inside).max() == 0
    assert object_index_map(house, inside).max() == -1
    assert FrozenRenderer(house, "cabinet_0", inside).transport.texels.numel() == 0
    assert render_views(house, inside).max() == 0


def test_index_maps_agree_with_coverage() -> None:
    house, cameras = tiny_house(), _towards((1.9, 1.9, 0.3))
    index = object_index_map(house, cameras)
    assert index.dtype == np.int16
    assert set(np.unique(index)) == {-1, 0, 1}
    share = np.stack([(index == i).mean((1, 2)) for i in range(2)], 1)
    np.testing.assert_allclose(share, object_coverage(house, cameras, 16), atol=0.01)


def test_depth_is_the_distance_along_the_ray() -> None:
    """Straight at the northern wall, over the furniture."""
    camera = Camera((0.0, -1.0, 1.5), 0.0, 0.0, 65, 49)
    depth = depth_map(tiny_house(), [camera])
    assert depth.shape == (1, 49, 65)
    wall = ROOM[1] / 2 + 1.0
    assert depth[0, 24, 32] == pytest.approx(wall, rel=1e-4)
    slope = np.tan(camera.vertical_fov / 2) * 10 / 24.5
    assert depth[0, 24, 42] == pytest.approx(wall * np.hypot(1, slope), rel=1e-4)
    assert direction(0.0)[1] == 1


@pytest.mark.parametrize("cameras", [[], "mixed"])
def test_cameras_of_no_or_of_two_sizes_are_refused(cameras: list[Camera] | str) -> None:
    if cameras == "mixed":
        cameras = [*_towards((0, 0, 0)), *_towards((0, 0, 0), 32, 24)]
    with pytest.raises(InputError, match="cameras: expected one or more of one image size"):
        render_views(tiny_house(), cameras, 4)  # type: ignore[arg-type]


def test_a_sample_count_that_is_no_square_is_refused() -> None:
    with pytest.raises(InputError, match="spp: expected a square number"):
        render_views(tiny_house(), _towards((0, 0, 0)), 8)
