"""Triangle meshes as binary little-endian PLY: our own, as Mitsuba reads them, and others'."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import DTypeLike, NDArray

from vlnhijack.artifacts import write_bytes
from vlnhijack.errors import InputError

Mesh = tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.float32]]
Elements = dict[str, NDArray[np.void]]

CORNERS = "vertex_indices"
_TYPES = {
    **dict.fromkeys(("char", "int8"), "<i1"),
    **dict.fromkeys(("uchar", "uint8"), "<u1"),
    **dict.fromkeys(("short", "int16"), "<i2"),
    **dict.fromkeys(("ushort", "uint16"), "<u2"),
    **dict.fromkeys(("int", "int32"), "<i4"),
    **dict.fromkeys(("uint", "uint32"), "<u4"),
    **dict.fromkeys(("float", "float32"), "<f4"),
    **dict.fromkeys(("double", "float64"), "<f8"),
}
_NAMES = {code: name for name, code in _TYPES.items() if not name[-1].isdigit()}
_START = ["ply", "format binary_little_endian 1.0"]
_LONGEST_HEADER = 1 << 14


def write_ply(
    path: Path,
    vertices: NDArray[np.float32],
    faces: NDArray[np.int32],
    uv: NDArray[np.float32],
) -> None:
    """Write vertices (N,3), faces (F,3) and uv (N,2)."""
    columns = dict(zip("xyzuv", np.hstack([vertices, uv], dtype=np.float32).T, strict=True))
    write_elements(path, columns, faces, {})


def read_ply(path: Path) -> Mesh:
    """Read vertices (N,3) float32, faces (F,3) int32, uv (N,2) float32 of a file of `write_ply`.

    Raises InputError where the file is missing, truncated or of another layout.
    """
    elements = read_elements(path)
    values = columns(path, elements, "vertex", "xyzuv", np.float32)
    return values[:, :3].copy(), triangles(path, elements), values[:, 3:].copy()


def write_elements(
    path: Path,
    vertex: Mapping[str, NDArray[np.generic]],
    faces: NDArray[np.int32],
    face: Mapping[str, NDArray[np.generic]],
) -> None:
    """Write named columns (N,) of vertices, faces (F,3), and further columns (F,) of faces."""
    corners: dict[str, NDArray[np.generic]] = {
        "count": np.full(len(faces), 3, np.uint8),
        CORNERS: faces.astype(np.int32),
    }
    vertex_block, face_block = _block(vertex), _block(corners | dict(face))
    header = [*_START, f"element vertex {len(vertex_block)}", *_properties(vertex)]
    header += [f"element face {len(face_block)}", f"property list uchar int {CORNERS}"]
    text = "\n".join([*header, *_properties(face), "end_header\n"])
    write_bytes(path, text.encode() + vertex_block.tobytes() + face_block.tobytes())


def read_elements(path: Path) -> Elements:
    """The elements of a binary little-endian file as records, which name every property.

    Lists hold three values: the corners of triangles. Raises InputError where the file is missing,
    truncated or of another layout.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(file=path, expected="a PLY mesh", received=error.strerror) from None
    layout, start = _layout(path, content)
    received = len(content) - start
    expected = sum(count * kind.itemsize for _, count, kind in layout)
    if received != expected:
        raise InputError(
            file=path, field="data", expected=f"{expected} bytes", received=f"{received} bytes"
        )
    elements: Elements = {}
    for name, count, kind in layout:
        elements[name] = np.frombuffer(content, kind, count, start)
        start += count * kind.itemsize
    return elements


def columns(
    path: Path, elements: Elements, element: str, names: str | list[str], dtype: DTypeLike
) -> NDArray:
    """Properties of an element as columns (N, names); InputError where one is missing."""
    found = elements.get(element)
    for name in names:
        if found is None or name not in (found.dtype.names or ()):
            raise InputError(
                file=path,
                field="header",
                expected=f"a property {name} of each {element}",
                received=found.dtype.names if found is not None else "none",
            )
    assert found is not None
    return np.stack([found[name].astype(dtype) for name in names], 1)


def triangles(path: Path, elements: Elements) -> NDArray[np.int32]:
    """Faces (F,3) into the vertices; InputError where there are none, or indices out of range."""
    columns(path, elements, "face", [CORNERS], np.int32)
    face = elements["face"]
    corners = np.asarray(face[CORNERS], np.int32)
    end = len(elements.get("vertex", ()))
    for wrong, expected, received in (
        ((face["count"] != 3).any(), "triangles", "other polygons"),
        (((corners < 0) | (corners >= end)).any(), f"indices in [0, {end})", "others"),
    ):
        if wrong:
            raise InputError(file=path, field="faces", expected=expected, received=received)
    return corners


def _block(named: Mapping[str, NDArray[np.generic]]) -> NDArray[np.void]:
    kinds = [
        (name, values.dtype.newbyteorder("<"), values.shape[1:]) for name, values in named.items()
    ]
    block = np.empty(len(next(iter(named.values()))), np.dtype(kinds))
    for name, values in named.items():
        block[name] = values
    return block


def _properties(named: Mapping[str, NDArray[np.generic]]) -> list[str]:
    return [
        f"property {_NAMES['<' + values.dtype.str[1:]]} {name}" for name, values in named.items()
    ]


def _layout(path: Path, content: bytes) -> tuple[list[tuple[str, int, np.dtype[np.void]]], int]:
    """Name, number and record of each element, and where the data start."""
    head, end, _ = content[:_LONGEST_HEADER].partition(b"end_header\n")
    lines = head.decode("ascii", "replace").splitlines()
    elements: list[tuple[str, int, list[tuple[str, str, tuple[int, ...]]]]] = []
    known = bool(end) and lines[:2] == _START
    for words in map(str.split, lines[2:]):
        match words:
            case ["element", name, count] if count.isdecimal() and len(count) < 16:
                elements.append((name, int(count), []))
            case ["property", "list", length, kind, name] if elements and (
                _TYPES.get(length) == "<u1" and kind in _TYPES
            ):
                elements[-1][2].extend([("count", "<u1", ()), (name, _TYPES[kind], (3,))])
            case ["property", kind, name] if elements and kind in _TYPES:
                elements[-1][2].append((name, _TYPES[kind], ()))
            case ["comment" | "obj_info", *_] | []:
                pass
            case _:
                known = False
    try:
        layout = [(name, count, np.dtype(fields)) for name, count, fields in elements]
    except ValueError:  # a property twice
        known = False
    if not known:
        raise InputError(
            file=path,
            field="header",
            expected="a binary little-endian PLY mesh of triangles",
            received=lines[:3],
        )
    return layout, len(head + end)
