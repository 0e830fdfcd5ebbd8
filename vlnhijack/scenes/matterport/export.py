"""A house written in Matterport3D's layout.

<name>/matterport_mesh/<name>/<name>.obj, .mtl, .jpg
<name>/house_segmentations/<name>.house, .ply, .fsegs.json, .semseg.json
<name>/matterport_skybox_images/<viewpoint>_skybox<k>_sami.jpg
connectivity/<name>_connectivity.json, scans.txt
"""

import io
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

from vlnhijack import display
from vlnhijack.artifacts import (
    atomic_folder,
    require_replaceable,
    write_bytes,
    write_json,
    write_text,
)
from vlnhijack.errors import InputError
from vlnhijack.navigation.graph import UPRIGHT, GraphFolder, save_graph
from vlnhijack.scenes.categories import mpcat40_id
from vlnhijack.scenes.house import House
from vlnhijack.scenes.house_files import check_name
from vlnhijack.scenes.matterport.house_text import house_text
from vlnhijack.scenes.matterport.skybox import PART, Images
from vlnhijack.scenes.ply import write_elements
from vlnhijack.scenes.surface import Surface

QUALITY = 95
_MESH = "matterport_mesh"


def export_scan(house: House, folder: Path, skyboxes: Iterable[tuple[str, Images]]) -> Path:
    """Write a baked house, and the six images (6,N,N,3) of viewpoints; the folder of the scan.

    Objects are numbered in the order of the house. The poses of the graph become upright, as the
    images of `rendering.skybox` are. Raises InputError for a lit house, for mirrored textures, and
    where the folder of the scan holds other files than a scan.
    """
    check_name(house.name, folder)
    require_replaceable(folder / house.name, _MESH)
    mirrored = [surface.name for surface in house.surfaces if surface.wrap == "mirror"]
    for wrong, field, expected, received in (
        (house.kind != "baked", "kind", "baked, for an export", house.kind),
        (mirrored, "wrap", "clamp or repeat, for OBJ", f"mirror of {mirrored}"),
    ):
        if wrong:
            raise InputError(file=house.name, field=field, expected=expected, received=received)
    with atomic_folder(folder / house.name) as new:
        _write_mesh(house, new / _MESH / house.name)
        _write_segmentation(house, new / "house_segmentations")
        for viewpoint, images in skyboxes:
            for side, image in enumerate(images):
                _write_jpeg(new / PART / f"{viewpoint}_skybox{side}_sami.jpg", image)
    graphs = folder / "connectivity"
    save_graph(replace(house.graph, rotations=UPRIGHT[None]), graphs)
    write_text(graphs / "scans.txt", "".join(f"{scan}\n" for scan in GraphFolder(graphs)))
    return folder / house.name


def _write_mesh(house: House, folder: Path) -> None:
    numbers: dict[tuple[int, str], int] = {}
    used = [
        numbers.setdefault((id(surface.texture), surface.wrap), len(numbers))
        for surface in house.surfaces
    ]
    library, text = [], io.BytesIO()
    text.write(f"mtllib {house.name}.mtl\n".encode())
    first = 1
    for number, (surface, material) in enumerate(zip(house.surfaces, used, strict=True)):
        if material not in used[:number]:
            name = f"{house.name}_{material:03d}.jpg"
            _write_jpeg(folder / name, display.to_8bit(surface.texture))
            clamp = "-clamp on " if surface.wrap == "clamp" else ""
            library.append(f"newmtl m{material:03d}\nKd 1 1 1\nmap_Kd {clamp}{name}\n")
        text.write(f"usemtl m{material:03d}\n".encode())
        _write_surface(text, surface, first)
        first += len(surface.vertices)
    write_text(folder / f"{house.name}.mtl", "\n".join(library))
    write_bytes(folder / f"{house.name}.obj", text.getvalue())


def _write_surface(text: io.BytesIO, surface: Surface, first: int) -> None:
    corners = np.repeat(surface.faces.astype(np.int64) + first, 2, axis=1)
    np.savetxt(text, surface.vertices, "v %.6f %.6f %.6f")
    np.savetxt(text, surface.uv * [1, -1] + [0, 1], "vt %.7f %.7f")
    np.savetxt(text, corners, "f %d/%d %d/%d %d/%d")


def _write_segmentation(house: House, folder: Path) -> None:
    """Every surface is a segment."""
    counts = [len(surface.faces) for surface in house.surfaces]
    segment = np.repeat(np.arange(len(counts)), counts).astype(np.int32)
    order = {thing.id: index for index, thing in enumerate(house.objects)}
    owner = np.array([order.get(s.object_id or "", -1) for s in house.surfaces], np.int32)
    starts = np.cumsum([0] + [len(s.vertices) for s in house.surfaces])
    faces = [s.faces + start for s, start in zip(house.surfaces, starts, strict=False)]
    vertices = np.concatenate([s.vertices for s in house.surfaces])
    ids = [mpcat40_id(thing.category) for thing in house.objects]
    category = np.array([*ids, -1], np.int32)[owner]
    write_elements(
        folder / f"{house.name}.ply",
        dict(zip("xyz", vertices.T, strict=True)),
        np.concatenate(faces).astype(np.int32),
        {
            "material_id": segment,
            "segment_id": owner[segment],
            "category_id": category[segment],
        },
    )
    write_json(folder / f"{house.name}.fsegs.json", {"segIndices": segment.tolist()})
    groups = [
        {
            "id": index,
            "objectId": index,
            "segments": np.flatnonzero(owner == index).tolist(),
            "label": thing.category,
        }
        for index, thing in enumerate(house.objects)
    ]
    write_json(folder / f"{house.name}.semseg.json", {"segGroups": groups})
    text = house_text(house, owner.tolist())
    write_text(folder / f"{house.name}.house", text)


def _write_jpeg(path: Path, pixels: Images) -> None:
    content = io.BytesIO()
    Image.fromarray(pixels).save(content, "JPEG", quality=QUALITY, subsampling=0)
    write_bytes(path, content.getvalue())
