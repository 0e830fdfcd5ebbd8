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
from vlnhijack.scenes.surface import Surface, Wrap

WRAP_CODES: dict[Wrap, int] = {"clamp": 33071, "repeat": 10497, "mirror": 33648}
_UNLIT = "KHR_materials_unlit"


def save_glb(house: House, path: Path) -> None:
    """Write one node per surface, named by it; y up, metres. A shared texture is one material.

    Textures are JPEG to keep the file small; the exact texels are the PNG files of the house.
    Baked houses carry their light, so their materials are unlit.
    """
    scene = trimesh.Scene()
    materials: dict[tuple[int, Wrap], PBRMaterial] = {}
    for surface in house.surfaces:
        look = id(surface.texture), surface.wrap
        if look not in materials:
            materials[look] = _material(surface)
        mesh = _mesh(surface, materials[look])
        scene.add_geometry(mesh, node_name=surface.name, geom_name=surface.name)
    wraps = {surface.name: surface.wrap for surface in house.surfaces}
    complete = partial(_complete, wraps=wraps, unlit=house.kind == "baked")
    write_bytes(
        path,
        trimesh.exchange.gltf.export_glb(scene, include_normals=False, tree_postprocessor=complete),
    )


def _material(surface: Surface) -> PBRMaterial:
    return PBRMaterial(
        name=surface.name,
        baseColorTexture=_jpeg(surface),
        metallicFactor=0.0,
        roughnessFactor=1.0,
    )


def _mesh(surface: Surface, material: PBRMaterial) -> trimesh.Trimesh:
    visual = trimesh.visual.TextureVisuals(surface.uv * [1, -1] + [0, 1], material=material)
    vertices = z_up_to_y_up(surface.vertices)
    return trimesh.Trimesh(vertices, surface.faces, visual=visual, process=False)


def _jpeg(surface: Surface) -> Image.Image:
    """An image that trimesh writes as JPEG of quality 90 with full colour resolution."""
    image = Image.fromarray(display.to_8bit(surface.texture))
    image.format = "JPEG"
    image.save = partial(image.save, quality=90, subsampling=0)  # type: ignore[method-assign]
    return image


def _complete(tree: dict[str, Any], wraps: dict[str, Wrap], *, unlit: bool) -> None:
    """Add what trimesh does not write: wrap modes, and that materials are unlit."""
    tree["samplers"] = [{"wrapS": code, "wrapT": code} for code in WRAP_CODES.values()]
    for material in tree["materials"]:
        texture = material["pbrMetallicRoughness"]["baseColorTexture"]["index"]
        tree["textures"][texture]["sampler"] = list(WRAP_CODES).index(wraps[material["name"]])
    if unlit:
        tree["extensionsUsed"] = [*tree.get("extensionsUsed", []), _UNLIT]
        for material in tree["materials"]:
            material["extensions"] = {_UNLIT: {}}
