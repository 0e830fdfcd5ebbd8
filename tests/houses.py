"""A tiny house for tests: one room, two boxes on its floor, four viewpoints around the first."""

from typing import Literal

import numpy as np
import trimesh
from scipy.ndimage import zoom

from vlnhijack import seeds
from vlnhijack.frames import Camera, heading_of
from vlnhijack.navigation.graph import NavigationGraph
from vlnhijack.scenes.house import House, HouseObject, Light, Room
from vlnhijack.scenes.surface import Surface
from vlnhijack.scenes.uv_atlas import unwrap

ROOM = (5.0, 5.0, 2.5)


def tiny_house(kind: Literal["baked", "lit"] = "baked") -> House:
    """A room of 5 × 5 × 2.5 m with objects "cabinet_0" (0.9 m, centre) and "table_0" (corner)."""
    boxes = {
        "cabinet_0": ("cabinet", (0.0, 0.0, 0.45), (0.9, 0.9, 0.9)),
        "table_0": ("table", (1.9, 1.9, 0.3), (0.8, 0.6, 0.6)),
    }
    shell = _box((0.0, 0.0, ROOM[2] / 2), ROOM)
    shell.invert()
    surfaces = [_surface("shell", shell, None, 128)]
    surfaces += [
        _surface(name, _box(centre, size), name, 64) for name, (_, centre, size) in boxes.items()
    ]
    light = Light((0.0, 0.0, 2.45), (0.5, 0.0, 0.0), (0.0, -0.5, 0.0), (8.0, 8.0, 7.0))
    return House(
        name=f"tiny_{kind}",
        kind=kind,
        surfaces=tuple(surfaces),
        objects=tuple(HouseObject(i, c, "room_0", p, s) for i, (c, p, s) in boxes.items()),
        rooms=(Room("room_0", "living room", (-2.5, -2.5, 2.5, 2.5)),),
        graph=_graph(f"tiny_{kind}"),
        lights=(light,) if kind == "lit" else (),
        exposure=2.0 if kind == "lit" else 1.0,
    )


def cabinet_cameras(width: int = 32, height: int = 24) -> list[Camera]:
    """Four cameras that look at the cabinet from the viewpoints."""
    house = tiny_house()
    centre = np.array(house.object("cabinet_0").centre)
    return [
        Camera((x, y, z), float(heading_of(centre - (x, y, z))), -0.4, width, height)
        for x, y, z in house.graph.positions.tolist()
    ]


def _box(centre: tuple[float, float, float], size: tuple[float, float, float]) -> trimesh.Trimesh:
    return trimesh.creation.box(size).apply_translation(centre)


def _surface(name: str, mesh: trimesh.Trimesh, object_id: str | None, size: int) -> Surface:
    atlas = unwrap(mesh.vertices, mesh.faces, size)
    vertices = np.asarray(mesh.vertices, np.float32)[atlas.source]
    return Surface(name, vertices, atlas.faces, atlas.uv, _texture(name, size), object_id)


def _texture(name: str, size: int) -> np.ndarray:
    """Smooth patches and fine noise, in exact 8-bit steps."""
    random = seeds.stream(0, "tiny house", name)
    smooth = zoom(random.uniform(0.2, 0.8, (9, 9, 3)), (size / 9, size / 9, 1), order=1)
    values = smooth + random.uniform(-0.1, 0.1, smooth.shape)
    return np.round(values * 255).astype(np.float32) / np.float32(255)


def _graph(scan: str) -> NavigationGraph:
    """A square cycle around the cabinet; the diagonals are blocked by it."""
    positions = np.array([[-1.2, -1.2, 1.5], [1.2, -1.2, 1.5], [1.2, 1.2, 1.5], [-1.2, 1.2, 1.5]])
    adjacency = np.zeros((4, 4), bool)
    for i in range(4):
        adjacency[i, (i + 1) % 4] = adjacency[(i + 1) % 4, i] = True
    names = tuple(f"{i:032x}" for i in range(4))
    return NavigationGraph(scan, names, positions, adjacency, np.full(4, 1.5))
