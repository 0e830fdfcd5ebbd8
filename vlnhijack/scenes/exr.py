"""Float textures as OpenEXR files."""

from pathlib import Path

import numpy as np
import OpenEXR
from numpy.typing import NDArray

from vlnhijack.artifacts import atomic_path
from vlnhijack.errors import InputError


def write_exr(path: Path, texture: NDArray[np.float32]) -> None:
    """Write a texture (H,W,3) float32 without loss."""
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with atomic_path(path) as temporary:
        channels = {"RGB": np.ascontiguousarray(texture, np.float32)}
        OpenEXR.File(header, channels).write(str(temporary))


def read_exr(path: Path) -> NDArray[np.float32]:
    """The texture (H,W,3) float32; InputError where the file is missing or has no RGB."""
    try:
        with OpenEXR.File(str(path)) as file:
            return np.array(file.channels()["RGB"].pixels, np.float32)
    except (RuntimeError, OSError, KeyError) as error:
        raise InputError(f"not an OpenEXR file with RGB ({error})", file=path) from None
