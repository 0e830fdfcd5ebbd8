"""Was the texture really applied? What was optimised against what lies on disk."""

import warnings
from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from scipy import stats

from vlnhijack.errors import CheckError
from vlnhijack.scenes.house import House
from vlnhijack.threat import Texture, violation

LARGEST_DIFFERENCE = 0.5 / 255
_TILE = 8
_SIGNIFICANCE = 0.01


def check_texels(
    house: House, object_id: str, exported: Texture, original: Texture, epsilon: float
) -> float:
    """The reloaded texture is the exported one, inside the ε-ball; the budget's violation (≤ 0)."""
    loaded = house.surface(object_id).texture
    if loaded.shape != exported.shape:
        raise CheckError(
            f"apply check: {object_id} on disk is {loaded.shape}, exported was {exported.shape}"
        )
    if not np.array_equal(loaded, exported):
        changed = int((loaded != exported).any(-1).sum())
        raise CheckError(f"apply check: {changed} texels of {object_id} on disk differ from export")
    excess = violation(loaded, original, epsilon)
    if excess > 1e-6:
        raise CheckError(f"apply check: {object_id} exceeds ε = {epsilon} by {excess:.3g}")
    return excess


def check_same_samples(optimised: torch.Tensor, reloaded: torch.Tensor) -> float:
    """Images (V,3,h,w) at the same samples agree within 0.5/255; the largest difference."""
    largest = float((optimised - reloaded).abs().max())
    if not largest <= LARGEST_DIFFERENCE:
        raise CheckError(
            f"apply check: optimiser's and reloaded images differ by {255 * largest:.2f}/255 "
            "at the same samples, allowed is 0.5/255"
        )
    return largest


def check_other_samples(
    optimiser: Sequence[torch.Tensor], reloaded: Sequence[torch.Tensor]
) -> tuple[float, int]:
    """Means over independent seeds agree; the smallest p and the number of tests.

    Both hold one image stack (V,3,h,w) per seed. Welch's t-test per 8×8 tile and channel, with
    Šidák's correction at 1 % (as Mitsuba's own render tests).
    """
    ours, theirs = _tiles(optimiser), _tiles(reloaded)
    varies = (ours.std(0) > 1e-6) | (theirs.std(0) > 1e-6)
    constant = np.abs(ours.mean(0) - theirs.mean(0))[~varies]
    if constant.size and constant.max() > 1e-4:
        raise CheckError(f"apply check: noise-free tiles differ by {constant.max():.2g}")
    if not varies.any():
        return 1.0, 0
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Precision loss", RuntimeWarning)
        p = stats.ttest_ind(ours[:, varies], theirs[:, varies], axis=0, equal_var=False).pvalue
    threshold = 1 - (1 - _SIGNIFICANCE) ** (1 / p.size)
    smallest = float(np.nanmin(p))
    if smallest < threshold:
        raise CheckError(
            f"apply check: images at other samples differ (p = {smallest:.2g} in {p.size} tests)"
        )
    return smallest, int(p.size)


def _tiles(stacks: Sequence[torch.Tensor]) -> NDArray[np.float64]:
    pooled = [torch.nn.functional.avg_pool2d(stack, _TILE) for stack in stacks]
    return torch.stack(pooled).double().numpy().reshape(len(stacks), -1)
