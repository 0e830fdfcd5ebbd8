"""A texture with a patch of texels for each triangle: how colours of vertices become a texture.

A patch of 2×2 texels holds colours that are linear over its triangle exactly. Neighbouring patches
never mix, because lookups stay between the centres of a patch's own texels.
"""

import numpy as np
from numpy.typing import NDArray

from vlnhijack.scenes.importing.lookup import look_up
from vlnhijack.scenes.surface import Wrap

LARGEST = 4096


def bake_patches(
    corner_colours: NDArray[np.float32],
    corner_uv: NDArray[np.float32],
    texture: NDArray[np.float32],
    wrap: Wrap,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Texture (H,W,3) and corner uv (F,3,2) that show a texture times colours of F triangles.

    corner_colours (F,3,3) display values; texture (h,w,3) with corner_uv (F,3,2).
    """
    size = _patch_size(corner_uv, texture)
    count = len(corner_colours)
    patches_a_row = int(np.ceil(np.sqrt(count)))
    rows, columns = np.divmod(np.arange(count), patches_a_row)
    edge = patches_a_row * size
    baked = np.zeros((-(-count // patches_a_row) * size, edge, 3), np.float32)
    turn = _least_clipped(corner_colours)
    order = (turn[:, None] + np.arange(3)) % 3
    colours = np.take_along_axis(corner_colours, order[..., None], 1)
    uv = np.take_along_axis(corner_uv, order[..., None], 1)
    b = np.linspace(0, 1, size, dtype=np.float32)
    for row, c in enumerate(b):
        weights = np.stack([1 - b - c, b, np.full_like(b, c)])
        shown = look_up(texture, np.einsum("cs,fcd->fsd", weights, uv).reshape(-1, 2), wrap)
        shown *= np.einsum("cs,fcd->fsd", weights, colours).clip(0, 1).reshape(-1, 3)
        at = columns[:, None] * size + np.arange(size)
        baked[rows[:, None] * size + row, at] = shown.reshape(count, size, 3)
    return baked, _patch_uv(rows, columns, size, baked.shape, turn)


def _patch_size(corner_uv: NDArray[np.float32], texture: NDArray[np.float32]) -> int:
    """Texels along a patch: as many as most triangles have in the texture, at least two."""
    if texture.shape[:2] == (1, 1):
        return 2
    texels = corner_uv * texture.shape[1::-1]
    longest = np.linalg.norm(texels - np.roll(texels, 1, axis=1), axis=-1).max(axis=1)
    fits = max(2, int(LARGEST / np.ceil(np.sqrt(len(corner_uv)))))
    return int(np.clip(np.ceil(np.quantile(longest, 0.9)) + 1, 2, fits))


def _least_clipped(colours: NDArray[np.float32]) -> NDArray[np.int64]:
    """First corner (F,) of each triangle such that the patch's far texel leaves [0,1] least."""
    far = colours.sum(axis=1, keepdims=True) - 2 * colours
    return np.abs(far - far.clip(0, 1)).sum(axis=-1).argmin(axis=1)


def _patch_uv(
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    size: int,
    shape: tuple[int, ...],
    turn: NDArray[np.int64],
) -> NDArray[np.float32]:
    corners = np.array([[0, 0], [size - 1, 0], [0, size - 1]])
    at = np.stack([columns, rows], -1)[:, None] * size + corners + 0.5
    order = (np.arange(3) - turn[:, None]) % 3
    return (np.take_along_axis(at, order[..., None], 1) / shape[1::-1]).astype(np.float32)
