"""Image features of viewpoints in HAMT's HDF5 form.

A dataset `<scan>_<viewpoint>` (36, D) per viewpoint, whose first columns are the features (official
files may have logits behind them), with attributes scanId, viewpointId, image_w, image_h and vfov.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from vlnhijack.artifacts import atomic_path
from vlnhijack.errors import InputError
from vlnhijack.navigation.graph import NavigationGraph
from vlnhijack.navigation.views import VIEWS

VFOV = 60

Features = NDArray[np.float32]
_H5PY_ERRORS = (OSError, KeyError, RuntimeError, TypeError, ValueError, MemoryError)


def read_features(file: Path, graph: NavigationGraph, size: int) -> Features:
    """Features (M,36,size) of a scan's viewpoints, in the order of its graph.

    Only this scan is read, so the file may be larger than the memory. Raises InputError with file
    and dataset where it is no HDF5 file, a viewpoint is missing, or its features are not at least
    (36, size), floating and finite.
    """
    names = [f"{graph.scan}_{viewpoint}" for viewpoint in graph.viewpoints]
    with _open(file) as store:
        return np.stack([_views(file, store, name, size) for name in names])


def write_features(
    file: Path,
    scans: Iterable[tuple[NavigationGraph, Features]],
    image_size: tuple[int, int],
    made_by: str = "",
) -> None:
    """Write features (M,36,D) of each scan; HAMT reads them.

    image_size: height and width of the views in pixels; made_by: what the features hang on, for
    `cached_features`.
    """
    with atomic_path(file) as temporary, h5py.File(temporary, "w") as store:
        store.attrs["made_by"] = made_by
        for graph, features in scans:
            for viewpoint, views in zip(graph.viewpoints, features, strict=True):
                data = store.create_dataset(
                    f"{graph.scan}_{viewpoint}", data=views, compression="gzip"
                )
                data.attrs["scanId"], data.attrs["viewpointId"] = graph.scan, viewpoint
                data.attrs["image_h"], data.attrs["image_w"] = image_size
                data.attrs["vfov"] = VFOV


def cached_features(
    file: Path,
    graph: NavigationGraph,
    size: int,
    image_size: tuple[int, int],
    made_by: str,
    compute: Callable[[], Features],
) -> Features:
    """The features (M,36,size) of a scan in `file`, computed and written unless `made_by` did."""
    if file.exists() and _maker(file) == made_by:
        return read_features(file, graph, size)
    features = compute()
    write_features(file, [(graph, features)], image_size, made_by)
    return features


@contextmanager
def _open(file: Path) -> Iterator[h5py.File]:
    try:
        with h5py.File(file, "r") as store:
            yield store
    except FileNotFoundError:
        raise InputError(file=file, expected="an HDF5 file", received="no such file") from None
    except _H5PY_ERRORS as error:
        raise InputError(f"not a readable HDF5 file ({error})", file=file) from None


def _maker(file: Path) -> str:
    with _open(file) as store:
        return str(store.attrs.get("made_by", ""))


def _views(file: Path, store: h5py.File, name: str, size: int) -> Features:
    data = store.get(name)
    if not isinstance(data, h5py.Dataset):
        raise InputError(file=file, field=name, expected=f"a dataset ({VIEWS}, D)", received="none")
    shape: tuple[int, ...] = data.shape or ()
    fits = len(shape) == 2 and shape[0] == VIEWS and shape[1] >= size
    if data.dtype.kind != "f" or not fits:
        raise InputError(
            file=file,
            field=name,
            expected=f"floating ({VIEWS}, ≥ {size})",
            received=f"{data.dtype} {shape}",
        )
    views = np.asarray(data[:, :size], np.float32)
    if not np.isfinite(views).all():
        raise InputError(file=file, field=name, expected="finite values", received="others")
    return views
