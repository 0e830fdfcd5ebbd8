"""Turn solid textures into a bitmap on a UV atlas."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vlnhijack.scenes.procedural.materials import Material
from vlnhijack.scenes.uv_atlas import dilate, rasterise


def paint(
    vertices: NDArray[np.floating],
    faces: NDArray[np.integer],
    uv: NDArray[np.floating],
    face_material: NDArray[np.integer],
    materials: Sequence[Material],
    height: int,
    width: int,
) -> NDArray[np.float32]:
    """The texture (height, width, 3) float32 of a mesh (N,3), (F,3), (N,2).

    face_material (F,) names each face's entry of `materials`, evaluated at the point of the face
    that every texel shows. Texels that no face uses are copied from the nearest that one does.
    """
    texels = rasterise(uv, faces, height, width)
    corners = vertices.astype(np.float64)[faces]
    points = np.einsum("kc,kcd->kd", texels.barycentric, corners[texels.face])
    normals = face_normals(corners)[texels.face]
    wanted = np.asarray(face_material)[texels.face]
    colours = np.empty_like(points)
    order = np.argsort(wanted, kind="stable")
    starts = np.searchsorted(wanted[order], np.arange(len(materials) + 1))
    for index, material in enumerate(materials):
        mine = order[starts[index] : starts[index + 1]]
        if len(mine):
            colours[mine] = material(points[mine], normals[mine])
    texture = np.zeros((height, width, 3), np.float32)
    mask = np.zeros((height, width), bool)
    texture[texels.rows, texels.columns] = colours
    mask[texels.rows, texels.columns] = True
    return dilate(texture, mask)


def face_normals(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit normals (F,3) of corners (F,3,3); zero where a face has no area."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return normal / np.maximum(length, 1e-15)
