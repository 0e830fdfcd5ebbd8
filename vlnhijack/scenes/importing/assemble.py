"""A house of a source mesh: background by material, objects, rooms, and a navigation graph."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from vlnhijack import display
from vlnhijack.navigation.graph import NavigationGraph
from vlnhijack.scenes.house import House, HouseObject, Room
from vlnhijack.scenes.importing.patches import bake_patches
from vlnhijack.scenes.importing.source_mesh import BACKGROUND, Material, SourceMesh
from vlnhijack.scenes.surface import Surface

Rows = NDArray[np.int64]


def assemble(source: SourceMesh, name: str, graph: NavigationGraph, rooms: Sequence[Room]) -> House:
    """The baked house: what the mesh's images hold is what is seen.

    One surface for each material of the background and for each material of an object; they share
    the materials' images and keep their texture coordinates. No object is unwrapped (see
    `unwrapping`). Where vertices have colours, triangles get patches of texels (see `patches`).
    """
    surfaces = tuple(_surfaces(source))
    return House(
        name=name,
        kind="baked",
        surfaces=surfaces,
        objects=tuple(_objects(source, surfaces)),
        rooms=tuple(rooms),
        graph=graph,
    )


def _surfaces(source: SourceMesh) -> Iterator[Surface]:
    """Background first; faces without area, which nobody can see, are left out."""
    textures: dict[int, NDArray[np.float32]] = {}
    for owner, index, rows in _groups(source):
        material = source.materials[index]
        look = id(material if material.image is None else material.image)
        if look not in textures:
            textures[look] = _texture(material)
        prefix = "background" if owner == BACKGROUND else source.objects[owner].id
        corner_uv, texture = source.corner_uv[rows], textures[look]
        colours = _corner_colours(source, rows)
        if colours is not None:
            texture, corner_uv = bake_patches(colours, corner_uv, texture, material.wrap)
        vertices, faces, uv = _indexed(source, rows, corner_uv)
        yield Surface(
            name=f"{prefix}-{index:03d}",
            vertices=vertices,
            faces=faces,
            uv=uv,
            texture=texture,
            object_id=None if owner == BACKGROUND else prefix,
            wrap="clamp" if colours is not None else material.wrap,
        )


def _groups(source: SourceMesh) -> Iterator[tuple[int, int, Rows]]:
    """Object, material and rows of the faces that have both."""
    a, b, c = (source.vertices[source.faces[:, i]] for i in range(3))
    seen = np.flatnonzero(np.cross(b - a, c - a).any(axis=1))
    owner, material = source.face_object[seen], source.face_material[seen]
    order = np.lexsort((material, owner))
    seen, owner, material = seen[order], owner[order], material[order]
    ends = np.flatnonzero(np.diff(owner) | np.diff(material)) + 1
    for rows in np.split(np.arange(len(seen)), ends):
        yield int(owner[rows[0]]), int(material[rows[0]]), seen[rows]


def _texture(material: Material) -> NDArray[np.float32]:
    if material.image is None:
        return np.array(material.colour, np.float32).reshape(1, 1, 3)
    return display.from_8bit(material.image)


def _corner_colours(source: SourceMesh, rows: Rows) -> NDArray[np.float32] | None:
    """Colours (F,3,3) of the corners of these faces, or None where all are white."""
    if source.vertex_colours is None:
        return None
    colours = source.vertex_colours[source.faces[rows]]
    return None if (colours == 255).all() else display.from_8bit(colours)


def _indexed(
    source: SourceMesh, rows: Rows, corner_uv: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.float32]]:
    """Vertices, faces and uv in which corners of one place and one uv are one vertex."""
    corners = source.faces[rows].ravel().astype(np.int64)
    bits = np.ascontiguousarray(corner_uv.reshape(-1, 2) + np.float32(0)).view(np.int64).ravel()
    order = np.lexsort((bits, corners))
    new = np.ones(len(order), bool)
    new[1:] = (np.diff(corners[order]) != 0) | (np.diff(bits[order]) != 0)
    faces = np.empty(len(order), np.int32)
    faces[order] = np.cumsum(new) - 1
    first = order[new]
    vertices = source.vertices[corners[first]].astype(np.float32)
    return vertices, faces.reshape(-1, 3), corner_uv.reshape(-1, 2)[first]


def _objects(source: SourceMesh, surfaces: Sequence[Surface]) -> Iterator[HouseObject]:
    for thing in source.objects:
        points = [s.vertices for s in surfaces if s.object_id == thing.id]
        if points:
            low, high = (f([f(p, axis=0) for p in points], axis=0) for f in (np.min, np.max))
            cx, cy, cz = ((low + high) / 2).tolist()
            sx, sy, sz = (high - low).tolist()
            yield HouseObject(
                thing.id, thing.category, thing.room, (cx, cy, cz), (sx, sy, sz), unwrapped=False
            )
