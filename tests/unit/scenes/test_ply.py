"""PLY meshes come back bit for bit, and broken files are refused in one line."""

from pathlib import Path

import numpy as np
import pytest

from vlnhijack.errors import InputError
from vlnhijack.scenes.ply import read_ply, write_ply

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
