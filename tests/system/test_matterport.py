"""Our houses in Matterport3D's layout, and back."""

from pathlib import Path

import numpy as np
import pytest

from tests.houses import tiny_house
from vlnhijack.navigation.graph import load_graph
from vlnhijack.navigation.views import panorama_cameras
from vlnhijack.rendering.observe import render_views
from vlnhijack.rendering.skybox import skybox_images
from vlnhijack.scenes.house import House
from vlnhijack.scenes.matterport.export import export_scan
from vlnhijack.scenes.matterport.skybox import read_skybox, skybox_view

EDGE = 256


def psnr(a: np.ndarray, b: np.ndarray) -> float:
    return float(-10 * np.log10(np.mean((a.astype(float) - b.astype(float)) ** 2)))


@pytest.fixture(scope="module")
def house() -> House:
    return tiny_house()


@pytest.fixture(scope="module")
def scan(house: House, tmp_path_factory: pytest.TempPathFactory) -> Path:
    places = zip(house.graph.viewpoints, house.graph.positions.tolist(), strict=True)
    skyboxes = {name: skybox_images(house, (x, y, z), EDGE) for name, (x, y, z) in places}
    return export_scan(house, tmp_path_factory.mktemp("export"), skyboxes)


def test_the_skybox_shows_what_the_house_does(house: House, scan: Path) -> None:
    graph = load_graph(scan.parent / "connectivity", house.name)
    for row in (0, 2):
        x, y, z = house.graph.positions[row].tolist()
        images = read_skybox(scan, graph.viewpoints[row])
        cameras = panorama_cameras((x, y, z), 64, 48)
        shown = np.stack([skybox_view(images, graph.rotations[row], c) for c in cameras]) / 255
        rendered = render_views(house, cameras, 64).permute(0, 2, 3, 1).numpy()
        assert psnr(shown, rendered) > 30
        turned = np.roll(rendered, 1, axis=0)
        assert psnr(shown, turned) < 20
