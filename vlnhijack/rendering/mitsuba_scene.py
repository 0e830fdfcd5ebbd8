"""A Mitsuba scene in memory, built once from a house."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vlnhijack import display
from vlnhijack.rendering.filters import Filters
from vlnhijack.rendering.variant import activate
from vlnhijack.scenes.house import House, Light
from vlnhijack.scenes.surface import Surface, Wrap


@dataclass(frozen=True, eq=False)
class MitsubaScene:
    """A loaded scene and the index into `house.surfaces` of each of Mitsuba's shapes.

    surface_of_shape is indexed by shape pointer (see `surface_index`); -1 stands for a light.
    """

    scene: Any
    surface_of_shape: Any

    def surface_index(self, interaction: Any) -> Any:
        """Dr.Jit Int of the surface that was hit, -1 where none was."""
        mi = activate()
        import drjit as dr

        pointer: Any = dr.reinterpret_array(mi.UInt32, interaction.shape)
        return dr.gather(mi.Int32, self.surface_of_shape, pointer)


def build_scene(house: House, filters: Filters = Filters()) -> MitsubaScene:
    """The scene of a house: baked surfaces glow as they look, lit ones are diffuse.

    Baked textures are `raw` radiance. Lit textures are handed over as linear albedo, because
    Mitsuba decodes sRGB only when it reads a file. It is loaded by one thread: parallel loading can
    deadlock with Python's interpreter lock (Mitsuba issue 1649, Dr.Jit issue 524). Lights are
    loaded one by one: nested, their order and thus the paths of a seed would be random.
    """
    mi = activate()
    content: dict[str, Any] = {"type": "scene"}
    bitmaps: dict[tuple[int, Wrap], Any] = {}
    for index, surface in enumerate(house.surfaces):
        look = id(surface.texture), surface.wrap
        if look not in bitmaps:
            bitmaps[look] = mi.load_dict(_bitmap(surface, house.kind, filters))
        name = f"surface_{index}"
        content[name] = _mesh(name, surface, house.kind, bitmaps[look])
    for index, light in enumerate(house.lights if house.kind == "lit" else ()):
        content[f"light_{index}"] = mi.load_dict(_light(light))
    scene = mi.load_dict(content, parallel=False)
    return MitsubaScene(scene, _surface_of_shape(scene))


@lru_cache(maxsize=2)
def shared_scene(house: House, filters: Filters = Filters()) -> MitsubaScene:
    """The scene of a house for readers, who leave it as it is; the last two are kept."""
    return build_scene(house, filters)


def surface_number(house: House, object_id: str) -> int:
    """Index into `house.surfaces` of an object's surface; InputError where there is none."""
    return house.surfaces.index(house.surface(object_id))


def texture_key(house: House, object_id: str) -> str:
    """The scene parameter that holds an object's texture."""
    index = surface_number(house, object_id)
    plugin = "emitter.radiance" if house.kind == "baked" else "bsdf.reflectance"
    return f"surface_{index}.{plugin}.data"


def set_texture(built: MitsubaScene, house: House, object_id: str, values: NDArray) -> None:
    """Give an object another texture (H,W,3) of the same shape: radiance, or linear albedo."""
    params = activate().traverse(built.scene)
    params[texture_key(house, object_id)] = _bitmap_data(values)
    params.update()


def set_textures(built: MitsubaScene, textures: Sequence[NDArray[np.float32]]) -> None:
    """Give every surface of a baked scene another texture (H,W,3), of the same shape."""
    params = activate().traverse(built.scene)
    for index, texture in enumerate(textures):
        params[f"surface_{index}.emitter.radiance.data"] = _bitmap_data(texture)
    params.update()


def _bitmap(surface: Surface, kind: str, filters: Filters) -> dict[str, Any]:
    """A differentiable float texture: radiance, or linear albedo."""
    texture = surface.texture if kind == "baked" else display.decode(surface.texture)
    return {
        "type": "bitmap",
        "data": _bitmap_data(texture),
        "format": "variant",
        "raw": True,
        "filter_type": filters.lookup,
        "wrap_mode": filters.wrap if surface.wrap == "clamp" else surface.wrap,
    }


def bitmap_shape(texture_shape: Sequence[int]) -> tuple[int, int, int]:
    """The shape to broadcast a texture (H,W,3) to: Mitsuba's bitmaps have two texels a side."""
    height, width, channels = texture_shape
    return max(height, 2), max(width, 2), channels


def _bitmap_data(texture: NDArray[np.float32]) -> Any:
    whole = np.broadcast_to(texture, bitmap_shape(texture.shape))
    return activate().TensorXf(np.ascontiguousarray(whole, np.float32))


def _mesh(name: str, surface: Surface, kind: str, bitmap: Any) -> Any:
    mi = activate()
    props = mi.Properties()
    if kind == "baked":
        props["emitter"] = mi.load_dict({"type": "area", "radiance": bitmap})
        props["bsdf"] = mi.load_dict(
            {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0}}
        )
    else:
        props["bsdf"] = mi.load_dict({"type": "diffuse", "reflectance": bitmap})
    mesh = mi.Mesh(
        name, len(surface.vertices), len(surface.faces), has_vertex_texcoords=True, props=props
    )
    params = mi.traverse(mesh)
    params["vertex_positions"] = surface.vertices.ravel()
    params["faces"] = surface.faces.astype(np.uint32).ravel()
    params["vertex_texcoords"] = surface.uv.ravel()
    params.update()
    return mesh


def _light(light: Light) -> dict[str, Any]:
    to_world = np.eye(4)
    to_world[:3, 0], to_world[:3, 1], to_world[:3, 3] = light.half_u, light.half_v, light.centre
    normal = np.cross(light.half_u, light.half_v)
    to_world[:3, 2] = normal / np.linalg.norm(normal)
    return {
        "type": "rectangle",
        "to_world": activate().ScalarTransform4f(to_world),
        "emitter": {"type": "area", "radiance": {"type": "rgb", "value": list(light.radiance)}},
    }


def _surface_of_shape(scene: Any) -> Any:
    mi = activate()
    import drjit as dr

    pointers = np.array(dr.reinterpret_array(mi.UInt32, scene.shapes_dr()))
    table = np.full(pointers.max() + 1, -1, np.int32)
    for pointer, shape in zip(pointers, scene.shapes(), strict=True):
        prefix, _, index = shape.id().partition("_")
        table[pointer] = int(index) if prefix == "surface" else -1
    return mi.Int32(table)
