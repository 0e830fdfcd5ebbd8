"""Write a house as a Matterport3D scan, and the panoramas of a scan as pictures."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from PIL import Image
from rich.progress import Progress

from vlnhijack.artifacts import atomic_path
from vlnhijack.navigation.graph import NavigationGraph
from vlnhijack.navigation.views import panorama_cameras
from vlnhijack.rendering.skybox import skybox_images
from vlnhijack.scenes.house import House
from vlnhijack.scenes.house_files import load_house
from vlnhijack.scenes.matterport.export import export_scan
from vlnhijack.scenes.matterport.skybox import Images, read_skybox, skybox_view

WIDTH, HEIGHT = 640, 480


def export_house(source: Path, folder: Path, edge: int, progress: Progress) -> Path:
    """Write the house in `source` and its skybox images of edge² pixels; the scan's folder."""
    house = load_house(source)
    return export_scan(house, folder, _skyboxes(house, edge, progress))


def _skyboxes(house: House, edge: int, progress: Progress) -> Iterator[tuple[str, Images]]:
    task = progress.add_task(f"{house.name}: panoramas", total=len(house.graph.viewpoints))
    for name, (x, y, z) in zip(house.graph.viewpoints, house.graph.positions.tolist(), strict=True):
        yield name, skybox_images(house, (x, y, z), edge)
        progress.advance(task)


def save_panoramas(
    scan: Path, graph: NavigationGraph, viewpoints: Sequence[str], folder: Path, progress: Progress
) -> None:
    """Write the 36 views of viewpoints, 640 × 480, as MatterSim shows them.

    The files are `<viewpoint>_<view>.png`. Raises InputError where the graph lacks a viewpoint, or
    its skybox is missing or broken.
    """
    rows = [graph.row(viewpoint) for viewpoint in viewpoints]
    task = progress.add_task(f"{scan.name}: panoramas", total=len(rows))
    for row, viewpoint in zip(rows, viewpoints, strict=True):
        images = read_skybox(scan, viewpoint)
        for view, camera in enumerate(panorama_cameras((0.0, 0.0, 0.0), WIDTH, HEIGHT)):
            shown = skybox_view(images, graph.rotations[row], camera)
            with atomic_path(folder / f"{viewpoint}_{view:02d}.png") as path:
                Image.fromarray(shown).save(path)
        progress.advance(task)
