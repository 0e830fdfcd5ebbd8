"""Our houses in Matterport3D's layout, and back."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from rich.progress import Progress
from typer.testing import CliRunner

from tests.houses import tiny_house
from tests.scans import import_quietly
from vlnhijack.cli import app
from vlnhijack.experiments.export_house import export_house
from vlnhijack.navigation.graph import load_graph
from vlnhijack.navigation.views import panorama_cameras
from vlnhijack.rendering.coverage import object_pixels
from vlnhijack.rendering.observe import render_views
from vlnhijack.scenes.house import House
from vlnhijack.scenes.house_files import load_house, save_house
from vlnhijack.scenes.importing.unwrapping import unwrapped
from vlnhijack.scenes.matterport.skybox import read_skybox, skybox_view

EDGE = 256


def psnr(a: np.ndarray, b: np.ndarray) -> float:
    return float(-10 * np.log10(np.mean((a.astype(float) - b.astype(float)) ** 2)))


@pytest.fixture(scope="module")
def house() -> House:
    return tiny_house()


@pytest.fixture(scope="module")
def scan(house: House, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("export")
    save_house(house, folder / "house")
    with Progress(disable=True) as progress:
        return export_house(folder / "house", folder, EDGE, progress)


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


@pytest.fixture(scope="module")
def imported(scan: Path, tmp_path_factory: pytest.TempPathFactory) -> House:
    folder = tmp_path_factory.mktemp("houses") / "again"
    assert "100.00% of the faces are within 0.10 m" in " ".join(import_quietly(scan, folder))
    return load_house(folder)


def test_the_objects_are_the_same(house: House, imported: House) -> None:
    assert imported.name == house.name
    for number, thing in enumerate(house.objects):
        again = imported.object(str(number))
        assert again.category == thing.category
        assert imported.rooms[0].label == house.rooms[0].label
        np.testing.assert_allclose(again.centre, thing.centre, atol=1e-5)
        np.testing.assert_allclose(again.size, thing.size, atol=1e-5)
        faces = sum(len(part.faces) for part in imported.parts(str(number)))
        assert faces == len(house.surface(thing.id).faces)
    assert len(imported.objects) == len(house.objects)


def test_the_graph_is_the_same(house: House, imported: House) -> None:
    assert imported.graph.viewpoints == house.graph.viewpoints
    np.testing.assert_allclose(imported.graph.positions, house.graph.positions)
    assert np.array_equal(imported.graph.adjacency, house.graph.adjacency)
    np.testing.assert_allclose(imported.graph.heights, house.graph.heights)


def test_it_looks_the_same_but_for_jpeg(house: House, imported: House) -> None:
    x, y, z = house.graph.positions[1].tolist()
    cameras = panorama_cameras((x, y, z), 64, 48)
    shown, again = (render_views(each, cameras, 16).numpy() for each in (house, imported))
    assert psnr(shown, again) > 35
    assert object_pixels(imported, cameras).sum() == object_pixels(house, cameras).sum()


def test_an_object_of_a_scan_can_be_unwrapped(imported: House) -> None:
    x, y, z = imported.graph.positions[1].tolist()
    cameras = panorama_cameras((x, y, z), 64, 48)
    ready = unwrapped(imported, ["0"])
    shown, again = (render_views(each, cameras, 16).numpy() for each in (imported, ready))
    assert psnr(shown, again) > 35
    assert ready.surface("0").texture.shape[0] >= 64


def test_panoramas_are_written_as_mattersim_shows_them(scan: Path, tmp_path: Path) -> None:
    graph = load_graph(scan.parent / "connectivity", scan.name)
    arguments = ["house", "panoramas", str(scan), "--out", str(tmp_path), "--viewpoint"]
    arguments += [graph.viewpoints[1], "--connectivity", str(scan.parent / "connectivity")]
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 0, done.output
    files = sorted(tmp_path.iterdir())
    assert [f.name for f in files] == [f"{graph.viewpoints[1]}_{i:02d}.png" for i in range(36)]
    images, camera = read_skybox(scan, graph.viewpoints[1]), panorama_cameras((0, 0, 0), 640, 480)
    with Image.open(files[14]) as image:
        assert np.array_equal(image, skybox_view(images, graph.rotations[1], camera[14]))
