"""HAMT's HDF5 image features."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.fuzz import refused_or_read
from tests.grids import grid_graph
from vlnhijack import seeds
from vlnhijack.agents.features import cached_features, read_features, write_features
from vlnhijack.errors import InputError

EAST, WEST = grid_graph("east"), grid_graph("west")
SIZE = 5


def features(graph: Any) -> np.ndarray:
    random = seeds.stream(0, "features", graph.scan)
    return random.normal(size=(len(graph.viewpoints), 36, SIZE)).astype(np.float32)


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("features") / "views.hdf5"
    write_features(file, ((graph, features(graph)) for graph in (EAST, WEST)), (480, 640))
    return file


def test_written_features_read_again(file: Path) -> None:
    for graph in (EAST, WEST):
        assert np.array_equal(read_features(file, graph, SIZE), features(graph))


def test_the_layout_is_hamts(file: Path) -> None:
    """What `ImageFeaturesDB` of VLN-HAMT does, on the attributes of its preprocessing."""
    with h5py.File(file) as store:
        data = store["west_west03"]
        assert np.array_equal(data[...][:, :3].astype(np.float32), features(WEST)[3, :, :3])
        assert dict(data.attrs) == {
            "scanId": "west",
            "viewpointId": "west03",
            "image_w": 640,
            "image_h": 480,
            "vfov": 60,
        }


def test_logits_behind_the_features_are_left_out(tmp_path: Path) -> None:
    wide = np.concatenate([features(EAST), np.ones((len(EAST.viewpoints), 36, 7))], -1)
    with h5py.File(tmp_path / "wide.hdf5", "w") as store:
        for name, views in zip(EAST.viewpoints, wide, strict=True):
            store.create_dataset(f"east_{name}", data=views.astype(np.float64), compression="gzip")
    read = read_features(tmp_path / "wide.hdf5", EAST, SIZE)
    assert read.dtype == np.float32
    assert np.array_equal(read, features(EAST))


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (None, "east_east03: expected a dataset .*received 'none'"),
        (np.zeros((36, 4), np.float32), r"received 'float32 \(36, 4\)'"),
        (np.zeros((35, 5), np.float32), r"\(36, ≥ 5\), received 'float32 \(35, 5\)'"),
        (np.zeros(36, np.float32), r"\(36,\)"),
        (np.zeros((36, 5), np.int64), "expected floating"),
        (np.full((36, 5), np.nan), "expected finite values"),
    ],
)
def test_a_bad_dataset_is_named(tmp_path: Path, data: Any, expected: str) -> None:
    write_features(tmp_path / "bad.hdf5", [(EAST, features(EAST))], (480, 640))
    with h5py.File(tmp_path / "bad.hdf5", "a") as store:
        del store["east_east03"]
        if data is not None:
            store["east_east03"] = data
    with pytest.raises(InputError, match=rf"bad\.hdf5: east_east03: .*{expected.split(': ')[-1]}"):
        read_features(tmp_path / "bad.hdf5", EAST, SIZE)


def test_what_is_no_hdf5_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_features(tmp_path / "none.hdf5", EAST, SIZE)
    (tmp_path / "text.hdf5").write_text("features")
    with pytest.raises(InputError, match="not a readable HDF5 file"):
        read_features(tmp_path / "text.hdf5", EAST, SIZE)


def test_a_cache_is_made_again_when_its_maker_changes(tmp_path: Path) -> None:
    made: list[str] = []

    def cached(made_by: str) -> np.ndarray:
        def compute() -> np.ndarray:
            made.append(made_by)
            return features(EAST) + len(made)

        file = tmp_path / "cache.hdf5"
        return cached_features(file, EAST, SIZE, (96, 128), made_by, compute)

    first, again, other = (cached(maker) for maker in ("agent a", "agent a", "agent b"))
    assert made == ["agent a", "agent b"]
    assert np.array_equal(first, again)
    assert np.array_equal(other, features(EAST) + 2)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.binary(min_size=1, max_size=16), st.booleans())
def test_no_file_ends_in_a_traceback(file: Path, at: int, junk: bytes, cut: bool) -> None:
    whole = file.read_bytes()
    at %= len(whole)
    content = whole[:at] if cut else whole[:at] + junk + whole[at + len(junk) :]
    broken = file.with_name("broken.hdf5")
    refused_or_read(broken, content, lambda path: read_features(path, EAST, SIZE))
