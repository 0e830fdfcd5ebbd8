"""A house as a scene file of stock Mitsuba 3.9; text only, Mitsuba is not imported.

Baked: every surface is a black area emitter whose radiance is its texture as it is. Lit: every
surface is diffuse with an sRGB-encoded albedo texture, and the lights are rectangles. The renders
are linear; a lit house is displayed as encode(clip(exposure · radiance)).
"""

from xml.etree import ElementTree

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vlnhijack import frames
from vlnhijack.scenes.house import House, Light
from vlnhijack.scenes.surface import Surface

WIDTH, HEIGHT = 640, 480
_MAX_DEPTH = {"baked": 1, "lit": 6}
_LOOK_DOWN = np.deg2rad(-15)
_FAR_ENOUGH = 1.0

Element = ElementTree.Element


def mesh_path(surface: Surface) -> str:
    """Path of a surface's mesh inside the house folder."""
    return f"meshes/{surface.name}.ply"


def texture_paths(house: House) -> dict[str, str]:
    """Path inside the house folder of the texture of each surface, by the surface's name.

    Surfaces that share a texture (the same array) share the file named by the first of them.
    """
    owner: dict[int, str] = {}
    return {
        surface.name: f"textures/{owner.setdefault(id(surface.texture), surface.name)}.png"
        for surface in house.surfaces
    }


def scene_xml(house: House) -> str:
    """The scene with one camera; shape ids are surface names, and file names are relative."""
    scene = ElementTree.Element("scene", version="3.0.0")
    integrator = ElementTree.SubElement(scene, "integrator", type="path")
    _value(integrator, "integer", "max_depth", _MAX_DEPTH[house.kind])
    scene.append(_sensor(default_camera(house)))
    textures = texture_paths(house)
    for surface in house.surfaces:
        scene.append(_shape(surface, textures[surface.name], house.kind == "baked"))
    for number, light in enumerate(house.lights):
        scene.append(_light(light, f"light_{number}"))
    ElementTree.indent(scene)
    return ElementTree.tostring(scene, encoding="unicode") + "\n"


def default_camera(house: House) -> frames.Camera:
    """The viewpoint and heading that show most of the furniture of the room they are in."""
    objects = [(o.centre, np.linalg.norm(o.size)) for o in house.objects]
    centres = np.array([centre for centre, _ in objects]).reshape(-1, 3)
    sizes = np.array([size for _, size in objects])
    rooms = _rooms(house, centres)
    best, camera = -1.0, (house.graph.positions[0], 0.0)
    for position in house.graph.positions:
        offset = centres - position
        distance = np.linalg.norm(offset, axis=1)
        weight = sizes / np.maximum(distance, _FAR_ENOUGH)
        weight *= (rooms == _rooms(house, position[None])) & (distance > _FAR_ENOUGH)
        for heading in np.arange(12) * np.pi / 6:
            angle = np.abs(frames.wrap(frames.heading_of(offset) - heading))
            score = float((weight * (angle < np.pi / 6)).sum())
            if score > best:
                best, camera = score, (position, float(heading))
    x, y, z = map(float, camera[0])
    return frames.Camera((x, y, z), camera[1], _LOOK_DOWN, WIDTH, HEIGHT)


def _rooms(house: House, points: ArrayLike) -> NDArray[np.int64]:
    """Index of the room that each point (K,3) lies in, or -1."""
    x, y = np.asarray(points, float)[:, :2].T
    room = np.full(len(x), -1)
    for number, (x0, y0, x1, y1) in enumerate(r.bounds for r in house.rooms):
        room[(x0 <= x) & (x <= x1) & (y0 <= y) & (y <= y1)] = number
    return room


def _sensor(camera: frames.Camera) -> Element:
    sensor = Element("sensor", type="perspective")
    _value(sensor, "float", "fov", float(np.rad2deg(camera.vertical_fov)))
    _value(sensor, "string", "fov_axis", "y")
    _value(sensor, "float", "near_clip", 0.01)
    sensor.append(_transform(frames.camera_to_world(camera)))
    film = ElementTree.SubElement(sensor, "film", type="hdrfilm")
    _value(film, "integer", "width", camera.width)
    _value(film, "integer", "height", camera.height)
    ElementTree.SubElement(film, "rfilter", type="box")
    sampler = ElementTree.SubElement(sensor, "sampler", type="independent")
    _value(sampler, "integer", "sample_count", 16)
    return sensor


def _shape(surface: Surface, file: str, emits: bool) -> Element:
    shape = Element("shape", type="ply", id=surface.name)
    _value(shape, "string", "filename", mesh_path(surface))
    _value(shape, "boolean", "face_normals", "true")
    bsdf = ElementTree.SubElement(shape, "bsdf", type="diffuse")
    if emits:
        _value(bsdf, "rgb", "reflectance", 0)
        emitter = ElementTree.SubElement(shape, "emitter", type="area")
        emitter.append(_texture(surface, file, "radiance", raw=True))
    else:
        bsdf.append(_texture(surface, file, "reflectance", raw=False))
    return shape


def _texture(surface: Surface, file: str, name: str, *, raw: bool) -> Element:
    texture = Element("texture", type="bitmap", name=name)
    _value(texture, "string", "filename", file)
    _value(texture, "boolean", "raw", str(raw).lower())
    _value(texture, "string", "filter_type", "bilinear")
    _value(texture, "string", "wrap_mode", surface.wrap)
    _value(texture, "string", "format", "variant")
    return texture


def _light(light: Light, name: str) -> Element:
    u, v = np.array(light.half_u), np.array(light.half_v)
    normal = np.cross(u, v)
    pose = np.eye(4)
    pose[:3] = np.stack([u, v, normal / np.linalg.norm(normal), light.centre], 1)
    shape = Element("shape", type="rectangle", id=name)
    shape.append(_transform(pose))
    emitter = ElementTree.SubElement(shape, "emitter", type="area")
    _value(emitter, "rgb", "radiance", _numbers(np.array(light.radiance)))
    return shape


def _transform(matrix: NDArray[np.float64]) -> Element:
    transform = Element("transform", name="to_world")
    ElementTree.SubElement(transform, "matrix", value=_numbers(matrix.ravel()))
    return transform


def _value(parent: Element, tag: str, name: str, value: object) -> None:
    ElementTree.SubElement(parent, tag, name=name, value=str(value))


def _numbers(values: NDArray[np.float64]) -> str:
    return " ".join(f"{value:.9g}" for value in values + 0.0)
