"""Which side of its faces a mesh shows, and faces that are made to show both.

Surfaces of a house show their front only. Meshes of other tools have walls without a back, leaves
seen from below, and parts whose faces point inwards.
"""

from dataclasses import dataclass, replace

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from trimesh.ray.ray_pyembree import RayMeshIntersector

from vlnhijack.scenes.importing.source_mesh import SourceMesh

RAYS = 20_000  # from each viewpoint, evenly spread
INWARD = 0.9  # of the rays that hit a part hit its backs: the part is turned inside out
THICKNESS = 1e-3  # metres between the two sides of a face that shows both

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Sides:
    """Counts of faces: seen from the back, turned round, made two-sided."""

    seen_from_back: int
    turned: int
    doubled: int


def show_sides(source: SourceMesh, positions: Array) -> tuple[SourceMesh, Sides]:
    """The mesh without black backs in sight of the viewpoints (M,3), and what was done.

    Parts (connected faces) seen nearly always from the back are turned round. Where another part
    is open, its faces seen from the back, and those around them, get a second face just behind that
    shows the other way. Closed parts stay as they are.
    """
    front, back = seen_sides(source.vertices, source.faces, positions)
    part, closed = _parts(source)
    hits, backs = (np.bincount(part, counts, len(closed)) for counts in (front + back, back))
    inward = (backs >= INWARD * hits) & (hits > 0)
    turned = inward[part]
    double = _around(source.faces, (back > 0) & ~turned & ~closed[part]) & ~turned
    double &= ~closed[part]
    faces, uv = source.faces.copy(), source.corner_uv.copy()
    faces[turned], uv[turned] = faces[turned][:, ::-1], uv[turned][:, ::-1]
    shown = _doubled(replace(source, faces=faces, corner_uv=uv), double)
    return shown, Sides(int((back > 0).sum()), int(turned.sum()), int(double.sum()))


def seen_sides(
    vertices: NDArray[np.floating], faces: NDArray[np.integer], positions: Array
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """How many rays from viewpoints (M,3) meet the front and the back of each face, (F,) each."""
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    scene = RayMeshIntersector(mesh)
    corners = np.asarray(vertices, float)[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    rays = _directions(RAYS)
    front, back = (np.zeros(len(faces), np.int64) for _ in range(2))
    for position in positions:
        hit = scene.intersects_first(np.broadcast_to(position, rays.shape), rays)
        facing = np.einsum("kd,kd->k", normals[hit], rays)
        for counts, side in ((front, facing < 0), (back, facing > 0)):
            counts += np.bincount(hit[side & (hit >= 0)], minlength=len(faces))
    return front, back


def _directions(count: int) -> Array:
    """Unit vectors spread evenly by the golden angle."""
    number = np.arange(count) + 0.5
    height = 1 - 2 * number / count
    angle = np.pi * (1 + 5**0.5) * number
    radius = np.sqrt(1 - height**2)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=-1)


def _parts(source: SourceMesh) -> tuple[NDArray[np.int64], Mask]:
    """Connected part of each face, and whether each part is closed.

    Corners at one place are joined; a part is closed where all of its edges have two faces.
    """
    _, place = np.unique(source.vertices, axis=0, return_inverse=True)
    corners = place.reshape(-1)[source.faces]
    ends = np.sort(np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]), 1)
    face = np.tile(np.arange(len(corners)), 3)
    codes = ends[:, 0] * (corners.max() + 1) + ends[:, 1]
    _, edge, uses = np.unique(codes, return_inverse=True, return_counts=True)
    order = np.argsort(edge, kind="stable")
    same = edge[order][1:] == edge[order][:-1]
    pairs = face[order][:-1][same], face[order][1:][same]
    shape = (len(corners),) * 2
    links = csr_array((np.ones(len(pairs[0]), bool), pairs), shape=shape)
    count, part = connected_components(links, directed=False)
    is_open = np.bincount(part[face], uses[edge] != 2, count) > 0
    return part, ~is_open


def _around(faces: NDArray[np.int32], chosen: Mask) -> Mask:
    """The chosen faces and all that share a vertex with one."""
    touched = np.zeros(faces.max() + 1, bool)
    touched[faces[chosen]] = True
    return np.asarray(touched[faces].any(axis=1))


def _doubled(source: SourceMesh, double: Mask) -> SourceMesh:
    """The mesh with a second face behind those marked, a millimetre away, seen from there."""
    if not double.any():
        return source
    corners = source.vertices[source.faces[double]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)
    behind = (corners - THICKNESS * normals[:, None]).reshape(-1, 3)
    indices = len(source.vertices) + np.arange(len(behind), dtype=np.int32).reshape(-1, 3)
    colours = source.vertex_colours
    if colours is not None:
        colours = np.concatenate([colours, colours[source.faces[double]].reshape(-1, 3)])
    return replace(
        source,
        vertices=np.concatenate([source.vertices, behind]),
        faces=np.concatenate([source.faces, indices[:, ::-1]]),
        corner_uv=np.concatenate([source.corner_uv, source.corner_uv[double][:, ::-1]]),
        vertex_colours=colours,
        face_material=np.concatenate([source.face_material, source.face_material[double]]),
        face_object=np.concatenate([source.face_object, source.face_object[double]]),
    )
