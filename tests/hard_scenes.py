"""Scenes that are hard to render: each has one attackable object and is small enough for a twin.

The cameras look north (+y) from near the origin; a patterned wall closes most scenes behind.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import trimesh
from numpy.typing import ArrayLike

from vlnhijack import seeds
from vlnhijack.frames import Camera
from vlnhijack.navigation.graph import NavigationGraph
from vlnhijack.scenes.house import House, HouseObject, Room
from vlnhijack.scenes.surface import Surface

TARGET = "target_0"
WIDTH, HEIGHT = 48, 36
EAST, UP = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
GRAZING = np.deg2rad(89.9)
FAR = (6000.0, 8000.0, 0.0)  # 10 km


class Scene(NamedTuple):
    house: House
    cameras: list[Camera]


class Mesh(NamedTuple):
    """vertices (N,3), faces (F,3) counter-clockwise in front, uv (N,2)."""

    vertices: np.ndarray
    faces: np.ndarray
    uv: np.ndarray


UPRIGHT = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], float)  # uv of a board's corners


def board(centre: ArrayLike, right: ArrayLike, up: ArrayLike, uv: ArrayLike = UPRIGHT) -> Mesh:
    """A rectangle with half edges `right` and `up`, whose front is where right × up points."""
    middle, east, north = (np.asarray(x, float) for x in (centre, right, up))
    corners = [middle - east - north, middle + east - north, middle + east + north]
    corners.append(middle - east + north)
    return Mesh(np.array(corners), np.array([[0, 1, 2], [0, 2, 3]]), np.asarray(uv, float))


def facing(y: float, half: float = 0.5, uv: ArrayLike = UPRIGHT, x: float = 0.0) -> Mesh:
    """A square board that faces south, at (x, y, 0)."""
    return board((x, y, 0.0), np.multiply(half, EAST), np.multiply(half, UP), uv)


def join(*meshes: Mesh) -> Mesh:
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = [mesh.faces + start for mesh, start in zip(meshes, starts, strict=False)]
    vertices, uv = ([mesh[k] for mesh in meshes] for k in (0, 2))
    return Mesh(np.concatenate(vertices), np.concatenate(faces), np.concatenate(uv))


def box(centre: ArrayLike, size: ArrayLike) -> Mesh:
    """A closed box whose six sides all show the whole texture."""
    mesh = trimesh.creation.box(np.asarray(size, float)).apply_translation(centre)
    corners = mesh.vertices[mesh.faces.ravel()]
    axis = np.repeat(np.abs(mesh.face_normals).argmax(1), 3)
    sides = np.array([[1, 2], [0, 2], [0, 1]])[axis]
    uv = np.take_along_axis((corners - np.asarray(centre)) / size + 0.5, sides, 1)
    return Mesh(corners, np.arange(len(corners)).reshape(-1, 3), uv)


def camera(position: ArrayLike = (0.0, 0.0, 0.0), heading: float = 0.0, **other: float) -> Camera:
    x, y, z = np.asarray(position, float).tolist()
    return Camera((x, y, z), heading, other.pop("elevation", 0.0), WIDTH, HEIGHT, **other)


def scene(
    target: Mesh,
    cameras: Sequence[Camera] = (camera(), camera((0.1, -0.1, 0.1), 0.2)),
    texture: tuple[int, int] = (32, 32),
    rest: Sequence[Mesh] = (facing(3.0, 4.0),),
) -> Scene:
    """The target with a texture of so many rows and columns, and the background's meshes."""
    surfaces = [_surface(f"rest_{n}", mesh, (16, 16), None) for n, mesh in enumerate(rest)]
    surfaces.append(_surface("target", target, texture, TARGET))
    house = House(
        name="hard",
        kind="baked",
        surfaces=tuple(surfaces),
        objects=(HouseObject(TARGET, "cabinet", "room_0", (0.0, 2.0, 0.0), (1.0, 1.0, 1.0)),),
        rooms=(Room("room_0", "hallway", (-4.0, -4.0, 4.0, 4.0)),),
        graph=NavigationGraph("hard", ("0",), np.zeros((1, 3)), np.zeros((1, 1), bool), np.ones(1)),
    )
    return Scene(house, list(cameras))


def plain() -> Scene:
    return scene(facing(2.0))


def near_surface() -> Scene:
    """Cameras 1 cm from a board: straight, and turned until they look along it."""
    cameras = [camera(heading=heading) for heading in (0.0, 0.9)]
    return scene(board((0.0, 0.01, 0.0), (0.05, 0.0, 0.0), (0.0, 0.0, 0.05)), cameras)


def inside_object() -> Scene:
    """A camera in a closed box and one before it."""
    cameras = [camera((0.1, 2.0, 0.1), 0.4), camera((0.3, 0.0, 0.4), elevation=-0.1)]
    return scene(box((0.0, 2.0, 0.0), (1.0, 1.0, 1.0)), cameras)


def across_near_plane() -> Scene:
    """A floor 4 mm under the camera, from two metres behind it to two metres before it."""
    return scene(board((0.0, 0.0, -0.004), (0.5, 0.0, 0.0), (0.0, 2.0, 0.0)), [camera()])


def grazing() -> Scene:
    """A floor seen at 89.9° from five metres, as far as a narrow view shows."""
    height = 5 / np.tan(GRAZING)
    view = camera(elevation=GRAZING - np.pi / 2, vertical_fov=3e-4)
    return scene(board((0.0, 5.0, -height), (0.001, 0.0, 0.0), (0.0, 0.6, 0.0)), [view], rest=())


def sub_pixel() -> Scene:
    """A board of 6 cm, five metres off, where a pixel is 16 cm wide; four views of it."""
    cameras = [camera((0.041 * k, 0.0, 0.033 * k)) for k in range(4)]
    return scene(facing(5.0, 0.03), cameras, (4, 4), rest=[facing(6.0, 8.0)])


def behind_bars() -> Scene:
    """A board behind seven bars, as of a chair's back, 3 cm wide and 10 cm apart."""
    bars = [box((0.1 * k - 0.3, 1.5, 0.0), (0.03, 0.03, 0.9)) for k in range(7)]
    return scene(facing(2.0, 0.45), rest=[facing(3.0, 4.0), join(*bars)])


def coincident_faces() -> Scene:
    """A board in the plane of the wall, half of it twice, with mirrored uv."""
    twice = board((0.25, 3.0, 0.0), (0.25, 0.0, 0.0), (0.0, 0.0, 0.5), UPRIGHT[:, ::-1])
    return scene(join(facing(3.0), twice))


def degenerate_faces() -> Scene:
    """A board split at a point 1 µm from its left edge, with faces of no area."""
    whole = facing(2.0)
    split = np.array([-0.5 + 1e-6, 2.0, 0.1])
    vertices = np.concatenate([whole.vertices, [split, [0.0, 2.0, 0.0]]])
    uv = np.concatenate([whole.uv, [[1e-6, 0.4], [0.5, 0.5]]])
    fan = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
    flat = [[0, 0, 1], [2, 2, 2], [0, 5, 2]]
    return scene(Mesh(vertices, np.array(fan + flat), uv))


def loose_vertices() -> Scene:
    """Faces that share no vertex, among vertices of no face, some a thousand kilometres off."""
    whole = facing(2.0)
    corners = whole.faces.ravel()
    loose = np.array([[1e6, 1e6, 1e6], [0.0, 1.0, 0.0]])
    vertices = np.concatenate([loose, whole.vertices[corners]])
    uv = np.concatenate([np.zeros((2, 2)), whole.uv[corners]])
    return scene(Mesh(vertices, np.arange(2, 8).reshape(-1, 3), uv))


def narrow_charts() -> Scene:
    """Eight strips whose charts are one texel wide, touch, and lie in another order."""
    order = (3, 6, 1, 4, 7, 2, 5, 0)
    half = np.array([0.0625, 0.0, 0.0])
    strips = [
        board(
            (0.125 * k - 0.4375, 2.0, 0.0), half, (0.0, 0.0, 0.5), (UPRIGHT + [chart, 0]) / [8, 1]
        )
        for k, chart in enumerate(order)
    ]
    return scene(join(*strips), texture=(8, 8))


def fine_texture() -> Scene:
    """A board that fills the view with more than 16 × 16 texels in each pixel."""
    return scene(_filling(), [camera()], (17 * HEIGHT, 17 * WIDTH))


def coarse_texture() -> Scene:
    """A board that fills the view with texels larger than 16 × 16 pixels."""
    return scene(_filling(), [camera()], (2, 3))


def turned_uv() -> Scene:
    """Four boards: mirrored in u, in v, turned by 90° and by 30°."""
    turn = np.array([[np.cos(np.pi / 6), -0.5], [0.5, np.cos(np.pi / 6)]])
    across, upside_down = np.abs(UPRIGHT - [1, 0]), np.abs(UPRIGHT - [0, 1])
    turned = (np.roll(UPRIGHT, 1, axis=0), (UPRIGHT - 0.5) @ turn * 0.7 + 0.5)
    boards = [
        facing(2.0, 0.2, uv, 0.45 * k - 0.675)
        for k, uv in enumerate((across, upside_down, *turned))
    ]
    return scene(join(*boards))


def uv_outside() -> Scene:
    """uv from -1.5 to 2.5: most of the board shows the clamped border."""
    return scene(facing(2.0, uv=UPRIGHT * 4 - 1.5), texture=(8, 8))


def wide_texture() -> Scene:
    return scene(facing(2.0), texture=(5, 40))


def tall_texture() -> Scene:
    return scene(facing(2.0), texture=(40, 5))


def one_column() -> Scene:
    return scene(facing(2.0), texture=(16, 1))


def one_texel() -> Scene:
    return scene(facing(2.0), texture=(1, 1))


def far_away() -> Scene:
    """`plain`, 10 km from the origin."""
    house, cameras = plain()
    moved = [replace(s, vertices=s.vertices + np.float32(FAR)) for s in house.surfaces]
    there = [camera(np.add(c.position, FAR), c.heading) for c in cameras]
    return Scene(replace(house, surfaces=tuple(moved)), there)


def in_no_view() -> Scene:
    """The object lies behind the camera, a wall before it."""
    return scene(facing(-2.0), [camera()])


def _filling() -> Mesh:
    """A board of the view's shape, 2 % larger than the view at two metres."""
    half = 2.04 * np.tan(np.pi / 6)
    return board((0.0, 2.0, 0.0), (half * WIDTH / HEIGHT, 0.0, 0.0), (0.0, 0.0, half))


def _surface(name: str, mesh: Mesh, size: tuple[int, int], object_id: str | None) -> Surface:
    return Surface(
        name,
        mesh.vertices.astype(np.float32),
        mesh.faces.astype(np.int32),
        mesh.uv.astype(np.float32),
        seeds.stream(0, "hard", name).random((*size, 3), np.float32),
        object_id,
    )
