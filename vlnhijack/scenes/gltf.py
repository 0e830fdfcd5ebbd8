"""A house as one glTF file (.glb) that Blender and web viewers open."""

from functools import partial
from pathlib import Path
from typing import Any

import trimesh
from PIL import Image
from trimesh.visual.material import PBRMaterial

from vlnhijack import display
from vlnhijack.artifacts import write_bytes
from vlnhijack.frames import z_up_to_y_up
from vlnhijack.scenes.house import House
from vlnhijack.scenes.surface import Surface

_UNLIT = "KHR_materials_unlit"


def save_glb(house: House, path: Path) -> None:
    """Write one node per surface, named by it; y up, metres.

    Textures are JPEG to keep the file small; the exact texels are the PNG files of the house.
    Baked houses carry their light, so their materials are unlit.
    """
    scene = trimesh.Scene()
    for surface in house.surfaces:
        scene.add_geometry(_mesh(surface), node_name=surface.name, geom_name=surface.name)
    unlit = _make_unlit if house.kind == "baked" else None
    write_bytes(
        path,
        trimesh.exchange.gltf.export_glb(scene, include_normals=False, tree_postprocessor=unlit),
    )


def _mesh(surface: Surface) -> trimesh.Trimesh:
    material = PBRMaterial(
        name=surface.name,
        baseColorTexture=_jpeg(surface),
        metallicFactor=0.0,
        roughnessFactor=1.0,
    )
    visual = trimesh.visual.TextureVisuals(surface.uv * [1, -1] + [0, 1], material=material)
    vertices = z_up_to_y_up(surface.vertices)
    return trimesh.Trimesh(vertices, surface.faces, visual=visual, process=False)


def _jpeg(surface: Surface) -> Image.Image:
    """An image that trimesh writes as JPEG of quality 90 with full colour resolution."""
    image = Image.fromarray(display.to_8bit(surface.texture))
    image.format = "JPEG"
    image.save = partial(image.save, quality=90, subsampling=0)  # type: ignore[method-assign]
    return image


def _make_unlit(tree: dict[str, Any]) -> None:
    tree["extensionsUsed"] = [*tree.get("extensionsUsed", []), _UNLIT]
    for material in tree["materials"]:
        material["extensions"] = {_UNLIT: {}}
