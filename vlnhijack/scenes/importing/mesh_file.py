"""Read GLB, glTF, OBJ and PLY files through trimesh."""

import io
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.resolvers import FilePathResolver

from vlnhijack import display
from vlnhijack.errors import InputError
from vlnhijack.frames import y_up_to_z_up
from vlnhijack.scenes.importing.gltf_header import read_header
from vlnhijack.scenes.importing.looks import (
    PLAIN,
    Images,
    Look,
    each_once,
    gltf_look,
    obj_look,
    plain_look,
    without_image,
)
from vlnhijack.scenes.importing.memory import BYTES_PER_BYTE, require_memory
from vlnhijack.scenes.importing.mtl import MtlMaterial, material_libraries, read_mtl
from vlnhijack.scenes.importing.source_mesh import BACKGROUND, Material, SourceMesh

Up = Literal["y", "z"]

_UP: dict[str, Up] = {".glb": "y", ".gltf": "y", ".obj": "y", ".ply": "z"}
_WHITE = 255


@dataclass(frozen=True)
class ReadOptions:
    """How to read a mesh file.

    up: axis that points up, None for that of the format (y, but z for PLY); scale: metres of one
    unit; allow_missing: give missing or broken images a flat colour instead of refusing them.
    """

    up: Up | None = None
    scale: float = 1.0
    allow_missing: bool = False


@dataclass(frozen=True, eq=False)
class MeshFile:
    """What a file holds: the mesh, all of it background, and what its faces belong to.

    face_node (F,) int32 into `nodes`, each the names of a scene node and of its ancestors, the
    node first; notes: what was ignored or replaced.
    """

    mesh: SourceMesh
    face_node: NDArray[np.int32]
    nodes: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Piece:
    """The geometry of one node in the file's axes and units; colours (N,3) uint8 or None."""

    node: tuple[str, ...]
    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    corner_uv: NDArray[np.float32]
    colours: NDArray[np.uint8] | None
    material: Material


def read_mesh(file: Path, options: ReadOptions = ReadOptions()) -> MeshFile:
    """The mesh of a .glb, .gltf, .obj or .ply file in our world.

    Raises InputError that names file and field where the file or an image is missing or broken,
    does not fit into memory, or is no mesh of a house (see SourceMesh).
    """
    kind = file.suffix.lower()
    if kind not in _UP:
        expected = f"a mesh file ({', '.join(_UP)})"
        raise InputError(file=file, expected=expected, received=file.name)
    if not file.is_file():
        raise InputError(file=file, expected="a mesh file", received="no such file")
    require_memory(file, BYTES_PER_BYTE * file.stat().st_size)
    images = Images(file, options.allow_missing)
    scene, look = _READERS[kind](file, images)
    pieces = list(_pieces(images, scene, each_once(look), linear=kind in (".glb", ".gltf")))
    if not pieces:
        raise InputError(file=file, field="faces", expected="≥ 1 face", received=0)
    return _joined(file, pieces, images, options.up or _UP[kind], options.scale)


def _load(file: Path, *arguments: Any, **options: Any) -> trimesh.Scene:
    """What trimesh loads; whatever it raises on a broken file is an InputError."""
    try:
        return trimesh.load_scene(*arguments, process=False, **options)
    except Exception as error:
        reason = f"{type(error).__name__}: {error}"
        raise InputError(f"not a readable mesh ({reason[:200]})", file=file) from None


Reader = tuple[trimesh.Scene, Callable[[Any], Look]]


def _read_gltf(file: Path, images: Images) -> Reader:
    header, content = read_header(file)
    require_memory(file, BYTES_PER_BYTE * sum(buffer.byteLength for buffer in header.buffers))
    scene = _load(
        file,
        io.BytesIO(content),
        file_type=file.suffix[1:].lower(),
        resolver=FilePathResolver(str(file)),
    )
    return scene, partial(gltf_look, header, images)


def _read_obj(file: Path, images: Images) -> Reader:
    library: dict[str, MtlMaterial] = {}
    for path in material_libraries(file):
        if path.is_file() or not images.flat:
            library |= read_mtl(path)
        else:
            images.notes.append(f"material library {path.name} is missing: grey instead")
    scene = _load(file, str(file), split_objects=True)
    return scene, partial(obj_look, library, images)


def _read_ply(file: Path, images: Images) -> Reader:
    scene = _load(file, str(file))
    counts = _ply_counts(file)
    meshes = scene.geometry.values()
    found = [sum(len(getattr(m, part, ())) for m in meshes) for part in ("vertices", "faces")]
    if found[0] != counts["vertex"] or found[1] < counts["face"]:
        raise InputError(
            file=file,
            field="data",
            expected=f"{counts['vertex']} vertices and {counts['face']} faces or more",
            received=f"{found[0]} and {found[1]}",
        )
    return scene, partial(plain_look, images)


_READERS: dict[str, Callable[[Path, Images], Reader]] = {
    ".glb": _read_gltf,
    ".gltf": _read_gltf,
    ".obj": _read_obj,
    ".ply": _read_ply,
}


def _ply_counts(file: Path) -> dict[str, int]:
    """Elements of the header by name."""
    counts = {"vertex": 0, "face": 0}
    with file.open("rb") as lines:
        for line in lines:
            words = line.decode("ascii", "replace").split()
            if words[:1] == ["end_header"]:
                break
            if len(words) == 3 and words[0] == "element" and words[2].isdecimal():
                counts[words[1]] = int(words[2])
    return counts


def _pieces(
    images: Images, scene: trimesh.Scene, look: Callable[[Any], Look], *, linear: bool
) -> Iterator[_Piece]:
    """The pieces of all nodes; linear: colours of vertices are linear and not display values."""
    for name in scene.graph.nodes_geometry:
        matrix, key = scene.graph.get(name)
        geometry = scene.geometry[key]
        if not isinstance(geometry, trimesh.Trimesh) or not len(geometry.faces):
            continue
        visual: Any = geometry.visual
        if visual.kind == "face":
            geometry = geometry.copy()
            geometry.unmerge_vertices()
            visual = geometry.visual
        material = getattr(visual, "material", None)
        seen = Look(PLAIN) if material is None else look(material)
        if getattr(visual, "uv", None) is None:
            seen = without_image(seen, images)
        faces = np.asarray(geometry.faces, np.int64)
        vertices = _moved(images.file, geometry, faces, np.asarray(matrix, float))
        uv = _corner_uv(images.file, visual, faces, len(vertices), seen)
        if np.linalg.det(matrix[:3, :3]) < 0:
            faces, uv = faces[:, ::-1], uv[:, ::-1]
        colours = _colours(visual, linear=linear)
        node = _lineage(images.file, scene, name, material)
        yield _Piece(node, vertices, faces, uv, colours, seen.material)


def _moved(
    file: Path, geometry: trimesh.Trimesh, faces: NDArray[np.int64], matrix: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Vertices in the scene's axes; InputError where they or the faces are not whole."""
    vertices = np.asarray(geometry.vertices, float)
    for field, array in (("vertices", vertices), ("faces", faces)):
        if array.ndim != 2 or array.shape[1] != 3:
            raise InputError(file=file, field=field, expected="(N, 3)", received=array.shape)
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise InputError(
            file=file,
            field="faces",
            expected=f"indices in [0, {len(vertices)})",
            received=f"[{faces.min()}, {faces.max()}]",
        )
    with np.errstate(over="ignore", invalid="ignore"):
        return vertices @ matrix[:3, :3].T + matrix[:3, 3]


def _corner_uv(
    file: Path, visual: Any, faces: NDArray[np.int64], count: int, look: Look
) -> NDArray[np.float32]:
    """(F,3,2), v down, of a mesh of `count` vertices; zeros where the material has no image."""
    if look.material.image is None:
        return np.zeros((len(faces), 3, 2), np.float32)
    uv = np.asarray(visual.uv)
    if uv.ndim != 2 or len(uv) != count:
        raise InputError(
            file=file,
            field=f"texture coordinates of {look.material.name}",
            expected=f"{count}, one for each vertex",
            received=uv.shape,
        )
    offset, scale = look.transform
    down = np.asarray(uv, float)[:, :2] * [1, -1] + [0, 1]
    return np.asarray((down * scale + offset)[faces], np.float32)


def _colours(visual: Any, *, linear: bool) -> NDArray[np.uint8] | None:
    """Colours (N,3) of the vertices as display values, or None."""
    if visual.kind == "texture":
        values = visual.vertex_attributes.get("color")
        if values is None:
            return None
        colours = trimesh.visual.color.to_rgba(values)
    elif visual.kind in ("vertex", "face"):
        colours = visual.vertex_colors
    else:
        return None
    levels = np.asarray(colours, np.uint8)[:, :3]
    return display.to_8bit(display.encode(levels / 255)) if linear else levels


def _lineage(file: Path, scene: trimesh.Scene, name: str, material: Any) -> tuple[str, ...]:
    """Names of a node and its ancestors.

    trimesh adds an OBJ's material to the name of its object, and names a node without name by the
    file, which says nothing about what it is.
    """
    parents, names = scene.graph.transforms.parents, [name]
    while names[-1] in parents and len(names) <= len(parents):
        names.append(parents[names[-1]])
    suffix = getattr(material, "name", None)
    names[0] = name.removesuffix(f"_{suffix}") if suffix else name
    names[0] = "mesh" if names[0].startswith(file.name) else names[0]
    return tuple(map(str, names))


def _joined(file: Path, pieces: list[_Piece], images: Images, up: Up, scale: float) -> MeshFile:
    starts = np.cumsum([0] + [len(piece.vertices) for piece in pieces])
    counts = [len(piece.faces) for piece in pieces]
    materials = list({id(piece.material): piece.material for piece in pieces}.values())
    rank = {id(material): row for row, material in enumerate(materials)}
    nodes = list(dict.fromkeys(piece.node for piece in pieces))
    vertices = np.concatenate([piece.vertices for piece in pieces])
    with np.errstate(over="ignore", invalid="ignore"):
        vertices = scale * (y_up_to_z_up(vertices) if up == "y" else vertices)
    mesh = SourceMesh(
        file=str(file),
        vertices=vertices,
        faces=np.concatenate(
            [piece.faces + start for piece, start in zip(pieces, starts, strict=False)]
        ).astype(np.int32),
        corner_uv=np.concatenate([piece.corner_uv for piece in pieces]),
        vertex_colours=_all_colours(pieces),
        face_material=np.repeat([rank[id(p.material)] for p in pieces], counts).astype(np.int32),
        materials=tuple(materials),
        face_object=np.full(sum(counts), BACKGROUND, np.int32),
    )
    face_node = np.repeat([nodes.index(piece.node) for piece in pieces], counts)
    notes = tuple(dict.fromkeys(images.notes))
    return MeshFile(mesh, face_node.astype(np.int32), tuple(nodes), notes)


def _all_colours(pieces: list[_Piece]) -> NDArray[np.uint8] | None:
    if all(piece.colours is None for piece in pieces):
        return None
    white = (np.full((len(p.vertices), 3), _WHITE, np.uint8) for p in pieces)
    return np.concatenate(
        [blank if p.colours is None else p.colours for p, blank in zip(pieces, white, strict=True)]
    )
