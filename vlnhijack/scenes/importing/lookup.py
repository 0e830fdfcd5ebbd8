"""Colours of textures at texture coordinates, as the renderer looks them up."""

import numpy as np
from numpy.typing import NDArray

from vlnhijack.scenes.surface import Wrap


def look_up(
    texture: NDArray[np.float32], uv: NDArray[np.floating], wrap: Wrap
) -> NDArray[np.float32]:
    """Colours (K,3) of a texture (H,W,3) at uv (K,2): bilinear at u·W − ½, v·H − ½."""
    height, width, _ = texture.shape
    at = uv.astype(np.float64) * [width, height] - 0.5
    low = np.floor(at).astype(np.int64)
    share = (at - low).astype(np.float32)
    columns, rows = (
        [_inside(low[:, axis] + step, size, wrap) for step in (0, 1)]
        for axis, size in ((0, width), (1, height))
    )
    x, y = share[:, :1], share[:, 1:]
    top, bottom = (
        (1 - x) * texture[row, columns[0]] + x * texture[row, columns[1]] for row in rows
    )
    return np.asarray((1 - y) * top + y * bottom, np.float32)


def _inside(index: NDArray[np.int64], size: int, wrap: Wrap) -> NDArray[np.int64]:
    """The index in [0, size) that an index outside stands for."""
    if wrap == "clamp":
        return index.clip(0, size - 1)
    if wrap == "repeat":
        return index % size
    folded = index % (2 * size)
    return np.minimum(folded, 2 * size - 1 - folded)
