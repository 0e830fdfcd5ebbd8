"""The mesh of one surface as binary PLY with texture coordinates, as Mitsuba reads it."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vlnhijack.artifacts import write_bytes
from vlnhijack.errors import InputError

Mesh = tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.float32]]

_VERTEX = np.dtype([("position", "<f4", 3), ("uv", "<f4", 2)])
_FACE = np.dtype([("count", "u1"), ("indices", "<i4", 3)])
_HEADER = """ply
format binary_little_endian 1.0
element vertex {vertices}
property float x
property float y
property float z
property float u
property float v
element face {faces}
property list uchar int vertex_indices
end_header
"""
_LONGEST_HEADER = 300


def write_ply(
    path: Path,
    vertices: NDArray[np.float32],
    faces: NDArray[np.int32],
    uv: NDArray[np.float32],
) -> None:
    """Write vertices (N,3), faces (F,3) and uv (N,2)."""
    vertex_block = np.empty(len(vertices), _VERTEX)
    vertex_block["position"], vertex_block["uv"] = vertices, uv
    face_block = np.empty(len(faces), _FACE)
    face_block["count"], face_block["indices"] = 3, faces
    header = _HEADER.format(vertices=len(vertices), faces=len(faces))
    write_bytes(path, header.encode() + vertex_block.tobytes() + face_block.tobytes())


def read_ply(path: Path) -> Mesh:
    """Read vertices (N,3) float32, faces (F,3) int32, uv (N,2) float32 of a file of `write_ply`.

    Raises InputError where the file is missing, truncated or of another layout.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(file=path, expected="a PLY mesh", received=error.strerror) from None
    n, f, start = _counts(path, content)
    received = len(content) - start
    expected = n * _VERTEX.itemsize + f * _FACE.itemsize
    if received != expected:
        raise InputError(
            file=path, field="data", expected=f"{expected} bytes", received=f"{received} bytes"
        )
    vertex_block = np.frombuffer(content, _VERTEX, n, start)
    face_block = np.frombuffer(content, _FACE, f, start + n * _VERTEX.itemsize)
    if not (face_block["count"] == 3).all():
        raise InputError(file=path, field="faces", expected="triangles", received="other polygons")
    return (
        vertex_block["position"].astype(np.float32),
        face_block["indices"].astype(np.int32),
        vertex_block["uv"].astype(np.float32),
    )


def _counts(path: Path, content: bytes) -> tuple[int, int, int]:
    """Number of vertices and of faces, and where the data start."""
    head, end, _ = content[:_LONGEST_HEADER].partition(b"end_header\n")
    lines = (head + end).decode("ascii", "replace").splitlines()
    counts = {
        words[1]: int(words[2])
        for words in map(str.split, lines)
        if len(words) == 3 and words[0] == "element" and words[2].isdecimal()
    }
    n, f = counts.get("vertex", 0), counts.get("face", 0)
    if lines != _HEADER.format(vertices=n, faces=f).splitlines():
        raise InputError(
            file=path,
            field="header",
            expected="binary little-endian PLY with x y z u v and triangles",
            received=lines[:3],
        )
    return n, f, len(head + end)
