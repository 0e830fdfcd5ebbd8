"""Pictures of a house: views at a viewpoint, masks of an object, a sheet of the panorama."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

import numpy as np
import torch
from numpy.typing import NDArray
from rich.progress import Progress

from vlnhijack import seeds
from vlnhijack.errors import InputError
from vlnhijack.experiments.config import RenderSettings, Rung
from vlnhijack.experiments.rungs import attack_renderer
from vlnhijack.frames import Camera
from vlnhijack.navigation.views import COLUMNS, ROWS, VIEWS, panorama_cameras, view_angles
from vlnhijack.rendering.coverage import object_index_map
from vlnhijack.rendering.observe import render_views
from vlnhijack.report.figures import contact_sheet, outlined, save_image, save_mask
from vlnhijack.scenes.house import House

Pixels = NDArray[np.float32]


@dataclass(frozen=True)
class Pictures:
    """What to render: views of a viewpoint at width × height pixels, spp rays each.

    object_id is masked and outlined if it is given; rung None is `render_views`, the renderer of
    the evaluation.
    """

    viewpoint: str | None
    views: list[int]
    width: int
    height: int
    spp: int
    object_id: str | None = None
    rung: str | None = None


def render_house(house: House, wanted: Pictures, folder: Path, progress: Progress) -> None:
    """Write view_<index>.png, mask_<index>.png if an object is named, and panorama.png.

    Each view has camera rays of its own, whichever others are wanted. Raises InputError where the
    house lacks viewpoint or object, or is not of the rung's kind.
    """
    cameras = _cameras(house, wanted)
    names = [item.id for item in house.objects]
    column = None if wanted.object_id is None else names.index(house.object(wanted.object_id).id)
    task = progress.add_task(f"{house.name}, {len(wanted.views)} views", total=len(wanted.views))
    shown: dict[int, Pixels] = {}
    for view in wanted.views:
        image = _image(house, wanted, cameras[view], seeds.integer(0, "pictures", view))
        save_image(folder / f"view_{view:02d}.png", image)
        if column is not None:
            mask = object_index_map(house, [cameras[view]])[0] == column
            save_mask(folder / f"mask_{view:02d}.png", mask)
            image = outlined(image, mask).transpose(2, 0, 1)
        shown[view] = image
        progress.advance(task)
    _panorama(folder / "panorama.png", shown)


def _cameras(house: House, wanted: Pictures) -> list[Camera]:
    graph = house.graph
    if wanted.viewpoint not in graph.index:
        raise InputError(
            file=house.name,
            field="viewpoint",
            expected=f"one of {', '.join(graph.viewpoints)}",
            received=wanted.viewpoint or "none",
        )
    x, y, z = graph.positions[graph.index[wanted.viewpoint]].tolist()
    return panorama_cameras((x, y, z), wanted.width, wanted.height)


def _image(house: House, wanted: Pictures, camera: Camera, seed: int) -> Pixels:
    """One view (3,h,w)."""
    if wanted.rung is None:
        return render_views(house, [camera], wanted.spp, seed)[0].numpy()
    if wanted.rung not in get_args(Rung):
        raise InputError(
            field="rung", expected=f"one of {', '.join(get_args(Rung))}", received=wanted.rung
        )
    settings = RenderSettings().model_copy(update={"rung": wanted.rung, "attack_spp": wanted.spp})
    object_id = wanted.object_id or next((item.id for item in house.objects), "none")
    texture = torch.from_numpy(house.surface(object_id).texture)
    with torch.no_grad():
        return attack_renderer(settings, house, object_id, [camera], seed)(texture)[0].numpy()


def _panorama(path: Path, shown: Mapping[int, Pixels]) -> None:
    """A sheet by heading, the upper row on top; views that were not rendered stay white."""
    order = np.arange(VIEWS).reshape(ROWS, COLUMNS)[::-1].ravel().tolist()
    blank = np.ones_like(next(iter(shown.values())))
    labels = [_label(view) if view in shown else "" for view in order]
    contact_sheet(path, np.stack([shown.get(view, blank) for view in order]), COLUMNS, labels)


def _label(view: int) -> str:
    heading, elevation = np.rad2deg(view_angles(view))
    return f"{view}: {heading:.0f}°, {elevation:.0f}°"
