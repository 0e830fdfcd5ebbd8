"""Model only what a scene needs: fewer faces, fewer texels, the same objects and borders."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pyfqmr
import trimesh
from numpy.typing import NDArray
from PIL import Image
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from vlnhijack import display
from vlnhijack.scenes.house import House
from vlnhijack.scenes.importing.unwrapping import unwrap_object
from vlnhijack.scenes.surface import Surface

FEWEST = 16  # faces of a chart that is worth reducing
_CANDIDATES = 8

Mesh = tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.float32]]


def face_count(house: House) -> int:
    return sum(len(surface.faces) for surface in house.surfaces)


def reduce_faces(house: House, faces: int) -> House:
    """The house with about `faces` triangles, by quadric decimation of each chart on its own.

    A chart is a piece of a surface within which texture coordinates do not jump. Its border stays,
    so objects, materials and charts fit together without gaps; a house whose charts are small keeps
    more faces than asked for. New vertices take the texture coordinates of the nearest point of the
    old chart.
    """
    share = faces / face_count(house)
    if share >= 1:
        return house
    surfaces = tuple(_decimated(surface, share) for surface in house.surfaces)
    return replace(house, surfaces=surfaces)


def reduce_texels(house: House, edge: int) -> House:
    """The house whose textures have at most `edge` texels a side.

    Shared textures stay shared. Atlases of objects are unwrapped anew, so that no texel belongs to
    two charts.
    """
    shrunk: dict[int, NDArray[np.float32]] = {}
    unwrapped = {thing.id for thing in house.objects if thing.unwrapped}
    surfaces = []
    for surface in house.surfaces:
        if max(surface.texture.shape[:2]) <= edge:
            surfaces.append(surface)
        elif surface.object_id in unwrapped:
            surfaces.append(unwrap_object(str(surface.object_id), [surface], edge))
        else:
            key = id(surface.texture)
            if key not in shrunk:
                shrunk[key] = _shrunk(surface.texture, edge)
            surfaces.append(replace(surface, texture=shrunk[key]))
    return replace(house, surfaces=tuple(surfaces))


def _shrunk(texture: NDArray[np.float32], edge: int) -> NDArray[np.float32]:
    """Means of blocks of texels."""
    height, width, _ = texture.shape
    scale = edge / max(height, width)
    size = max(1, round(width * scale)), max(1, round(height * scale))
    image = Image.fromarray(display.to_8bit(texture)).resize(size, Image.Resampling.BOX)
    return display.from_8bit(np.asarray(image))


def _decimated(surface: Surface, share: float) -> Surface:
    meshes = [
        _decimated_chart(*mesh, target=round(share * len(mesh[1]))) for mesh in _charts(surface)
    ]
    starts = np.cumsum([0] + [len(vertices) for vertices, _, _ in meshes])
    return replace(
        surface,
        vertices=np.concatenate([vertices for vertices, _, _ in meshes]),
        faces=np.concatenate(
            [faces + start for (_, faces, _), start in zip(meshes, starts, strict=False)]
        ).astype(np.int32),
        uv=np.concatenate([uv for _, _, uv in meshes]),
    )


def _charts(surface: Surface) -> Iterator[Mesh]:
    """Large charts one by one, then all small ones together."""
    a, b, c = surface.faces.T
    count = len(surface.vertices)
    ends = np.concatenate([a, b]), np.concatenate([b, c])
    links = csr_array((np.ones(len(ends[0]), bool), ends), shape=(count, count))
    _, chart_of = connected_components(links, directed=False)
    chart = chart_of[a]
    sizes = np.bincount(chart)
    chart = np.where(sizes[chart] < FEWEST, -1, chart)
    order = np.argsort(chart, kind="stable")
    for rows in np.split(order, np.flatnonzero(np.diff(chart[order])) + 1):
        used, faces = np.unique(surface.faces[rows], return_inverse=True)
        yield surface.vertices[used], faces.reshape(-1, 3).astype(np.int32), surface.uv[used]


def _decimated_chart(
    vertices: NDArray[np.float32],
    faces: NDArray[np.int32],
    uv: NDArray[np.float32],
    *,
    target: int,
) -> Mesh:
    if len(faces) < FEWEST:
        return vertices, faces, uv
    simplifier = pyfqmr.Simplify()
    simplifier.setMesh(vertices, faces)
    simplifier.simplify_mesh(target_count=max(target, 2), preserve_border=True, verbose=False)
    fewer, new_faces, _ = simplifier.getMesh()
    if not 0 < len(new_faces) < len(faces):
        return vertices, faces, uv
    fewer = fewer.astype(np.float32)
    return fewer, new_faces.astype(np.int32), _uv_at(fewer, vertices, faces, uv)


def _uv_at(
    points: NDArray[np.float32],
    vertices: NDArray[np.float32],
    faces: NDArray[np.int32],
    uv: NDArray[np.float32],
) -> NDArray[np.float32]:
    """Texture coordinates (K,2) of the points of a mesh nearest to points (K,3)."""
    corners = vertices[faces].astype(np.float64)
    count = min(_CANDIDATES, len(faces))
    _, near = cKDTree(corners.mean(axis=1)).query(points, count)
    near = near.reshape(len(points), count)
    best, distance = np.zeros((len(points), 2)), np.full(len(points), np.inf)
    for face in near.T:
        on_face = trimesh.triangles.closest_point(corners[face], points.astype(np.float64))
        gap = np.linalg.norm(on_face - points, axis=1)
        weights = trimesh.triangles.points_to_barycentric(corners[face], on_face)
        found = np.einsum("kc,kcd->kd", weights, uv[faces[face]])
        nearer = (gap < distance) & np.isfinite(found).all(axis=1)
        best[nearer], distance[nearer] = found[nearer], gap[nearer]
    return best.astype(np.float32)
