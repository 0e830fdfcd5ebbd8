"""PLY meshes come back bit for bit, and broken files are refused in one line."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.fuzz import refused_or_read
from vlnhijack.errors import InputError
from vlnhijack.scenes.ply import (
    columns,
    read_elements,
    read_ply,
    triangles,
    write_elements,
    write_ply,
)

MESH = (
    np.random.default_rng(0).random((4, 3), np.float32),
    np.array([[0, 1, 2], [0, 2, 3]], np.int32),
    np.random.default_rng(1).random((4, 2), np.float32),
)


def test_round_trip(tmp_path: Path) -> None:
    write_ply(tmp_path / "mesh.ply", *MESH)
    for written, read in zip(MESH, read_ply(tmp_path / "mesh.ply"), strict=True):
        assert written.dtype == read.dtype and np.array_equal(written, read)


@pytest.mark.parametrize("cut", [0, 2, 50, 250, -1])
def test_truncated(tmp_path: Path, cut: int) -> None:
    path = tmp_path / "mesh.ply"
    write_ply(path, *MESH)
    path.write_bytes(path.read_bytes()[:cut])
    with pytest.raises(InputError, match=r"mesh\.ply: (data|header): expected"):
        read_ply(path)


@pytest.mark.parametrize(
    "old, new, field",
    [
        (b"format binary_little_endian", b"format binary_big_endian", "header"),
        (b"property float u", b"property float s", "header"),
        (b"vertex 4", b"vertex 9", "data"),
        (b"vertex 4", b"vertex -4", "header"),
    ],
)
def test_other_layouts(tmp_path: Path, old: bytes, new: bytes, field: str) -> None:
    path = tmp_path / "mesh.ply"
    write_ply(path, *MESH)
    path.write_bytes(path.read_bytes().replace(old, new))
    with pytest.raises(InputError, match=field):
        read_ply(path)


def test_polygons_that_are_no_triangles(tmp_path: Path) -> None:
    path = tmp_path / "mesh.ply"
    write_ply(path, *MESH)
    content = bytearray(path.read_bytes())
    content[-13] = 4
    path.write_bytes(bytes(content))
    with pytest.raises(InputError, match="triangles"):
        read_ply(path)


def test_missing(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="No such file"):
        read_ply(tmp_path / "mesh.ply")


def test_further_columns(tmp_path: Path) -> None:
    path = tmp_path / "mesh.ply"
    vertex = {"x": MESH[0][:, 0], "red": np.arange(4, dtype=np.uint8)}
    write_elements(path, vertex, MESH[1], {"segment_id": np.array([-1, 7], np.int32)})
    content = path.read_bytes().replace(b"element vertex", b"comment by hand\nelement vertex", 1)
    path.write_bytes(content)
    elements = read_elements(path)
    assert columns(path, elements, "face", ["segment_id"], np.int32).ravel().tolist() == [-1, 7]
    assert columns(path, elements, "vertex", ["red"], np.int32).ravel().tolist() == [0, 1, 2, 3]
    assert np.array_equal(triangles(path, elements), MESH[1])
    with pytest.raises(InputError, match="header: expected a property y of each vertex"):
        columns(path, elements, "vertex", "xyz", np.float64)


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("ply") / "mesh.ply"


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=12), st.integers(0, 400), st.booleans())
def test_no_mesh_ends_in_a_traceback(file: Path, junk: bytes, at: int, cut: bool) -> None:
    write_ply(file, *MESH)
    whole = file.read_bytes()
    refused_or_read(file, whole[:at] + junk + (b"" if cut else whole[at + len(junk) :]), read_ply)
