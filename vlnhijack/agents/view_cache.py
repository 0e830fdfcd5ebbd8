"""Features of views that show a changed texture, kept on disk."""

import hashlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from safetensors.torch import load_file, save
from torch import Tensor

from vlnhijack.artifacts import write_bytes


def cached_views(
    folder: Path,
    made_by: str,
    texture: NDArray[np.float32],
    views: Tensor,
    encode: Callable[[], Tensor],
) -> Tensor:
    """Features (V,D) of views (V,2), rows of the table and view indices; encoded only once.

    The file is named by the hash of the texture, of the views and of `made_by`: what else the
    features hang on.
    """
    digest = hashlib.sha256(f"{made_by}, texture {texture.shape}, views ".encode())
    digest.update(views.numpy().tobytes())
    digest.update(texture.tobytes())
    file = folder / f"{digest.hexdigest()}.safetensors"
    if not file.exists():
        write_bytes(file, save({"features": encode().contiguous()}))
    return load_file(file)["features"]
