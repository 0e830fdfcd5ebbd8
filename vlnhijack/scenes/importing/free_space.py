"""Where one can stand and walk in a mesh, found by casting rays."""

from collections.abc import Sequence
from itertools import product

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, label
from trimesh.ray.ray_pyembree import RayMeshIntersector

from vlnhijack.errors import InputError
from vlnhijack.navigation.graph import NavigationGraph
from vlnhijack.scenes.importing.source_mesh import SourceMesh
from vlnhijack.scenes.walking import CLEARANCE, EYE_HEIGHT, FreeSpace, walking_graph

CELL = 0.1
MOST_CELLS = 4_000_000
MOST_PLACES = 20_000
MOST_VIEWPOINTS = 100
HEADROOM = 1.8  # what a person needs above the floor
STEP_UP = 0.12  # what a person steps over
_BODY = (0.2, 0.9, EYE_HEIGHT)
_FLAT = 0.95
_STOREY = 0.1
_ENOUGH = 0.3  # of the area of the level with the most; roofs have much too

Array = NDArray[np.float64]
Cells = NDArray[np.bool_]


def make_walking_graph(source: SourceMesh, name: str, seed: int) -> NavigationGraph:
    """A graph of up to 100 viewpoints on the floor of the mesh, connected by walkable steps.

    The floor is the lowest level with much area to stand on; one storey is used.
    Spacing, steps and eye height are those of our own houses. Raises InputError where no two
    viewpoints fit.
    """
    mesh = trimesh.Trimesh(source.vertices, source.faces, process=False)
    space = free_space(mesh, source.file)
    landmarks = [
        trimesh.Trimesh(source.vertices, source.faces[source.face_object == row], process=False)
        for row in range(len(source.objects))
    ]
    graph = None
    if len(space.places):
        graph = walking_graph(
            name, seed, space, landmarks, MOST_VIEWPOINTS, lambda places: len(places) > 1
        )
    if graph is None:
        raise InputError(
            file=source.file,
            field="free space",
            expected="a floor with room for two viewpoints (is the up axis right? --up)",
            received=f"{len(space.places)} places to stand at {space.floor:.2f} m",
        )
    return graph


def free_space(mesh: trimesh.Trimesh, file: str) -> FreeSpace:
    """The largest connected part of the floor that has room for a person."""
    low, high = mesh.bounds[:, :2]
    shape = np.ceil((high - low) / CELL).astype(int) + 1
    if shape.prod() > MOST_CELLS:
        raise InputError(
            file=file,
            field="extent",
            expected=f"a floor of at most {MOST_CELLS * CELL**2:.0f} m² (or --connectivity)",
            received=f"{shape.prod() * CELL**2:.0f} m²",
        )
    centres = low + CELL * np.moveaxis(np.indices(tuple(shape)), 0, -1).reshape(-1, 2)
    scene = RayMeshIntersector(mesh)
    candidates = [_walkable(scene, centres, level) for level in _levels(mesh)]
    most = max(int(free.sum()) for _, free in candidates)
    floor, free = min(
        (found for found in candidates if found[1].sum() >= _ENOUGH * most), key=lambda c: c[0]
    )
    around = np.pad(free.reshape(shape), 1)
    distance = CELL * np.asarray(distance_transform_edt(around))[1:-1, 1:-1]

    def clearance(points: Array) -> Array:
        cells = np.round((points - low) / CELL).astype(int)
        inside = ((cells >= 0) & (cells < shape)).all(axis=1)
        rows, columns = cells.clip(0, shape - 1).T
        return np.where(inside, distance[rows, columns], 0.0)

    places = centres[_largest(distance >= CLEARANCE).ravel()]
    thin = max(1, -(-len(places) // MOST_PLACES))
    return FreeSpace(places[::thin], 0, clearance, mesh, floor)


def _levels(mesh: trimesh.Trimesh, count: int = 4) -> Sequence[float]:
    """Heights of the levels with the most level area, whichever side it shows."""
    flat = np.abs(mesh.face_normals[:, 2]) > _FLAT
    heights, areas = mesh.triangles_center[flat, 2], mesh.area_faces[flat]
    if len(heights) == 0:
        return [float(mesh.bounds[0, 2])]
    bins = np.round((heights - heights.min()) / _STOREY).astype(int)
    sums = np.bincount(bins, areas)
    best = [b for b in np.argsort(-sums)[:count] if sums[b] > 0]
    return [float(np.average(heights[bins == b], weights=areas[bins == b])) for b in best]


def _walkable(scene: RayMeshIntersector, centres: Array, level: float) -> tuple[float, Cells]:
    """Height of the floor near a level, and the cells (K,) where one can stand on it.

    There the floor is bare up to a person's height, and no wall passes through.
    """
    top = np.column_stack([centres, np.full(len(centres), level + HEADROOM)])
    ground = level + HEADROOM - _reach(scene, top, np.array([0.0, 0.0, -1.0]))
    free = np.abs(ground - level) <= STEP_UP
    floor = float(np.median(ground[free])) if free.any() else level
    for height, (x, y) in product(_BODY, ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))):
        rows = np.flatnonzero(free)
        origins = np.column_stack([centres[rows], np.full(len(rows), floor + height)])
        free[rows] = _reach(scene, origins, np.array([x, y, 0.0])) > CELL
    return floor, free


def _reach(scene: RayMeshIntersector, origins: Array, direction: Array) -> Array:
    """Metres (K,) to the first hit of each ray, infinite for none."""
    reach = np.full(len(origins), np.inf)
    if len(origins):
        rays = np.broadcast_to(direction, origins.shape)
        places, hit, _ = scene.intersects_location(origins, rays, multiple_hits=False)
        reach[hit] = np.linalg.norm(places - origins[hit], axis=1)
    return reach


def _largest(free: Cells) -> Cells:
    """The largest 8-connected part."""
    parts, count = label(free, np.ones((3, 3)))
    if count == 0:
        return free
    return np.asarray(parts == np.bincount(parts.ravel())[1:].argmax() + 1)
