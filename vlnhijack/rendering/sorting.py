"""Sorting of 64-bit keys on the device that they lie on."""

import numpy as np
import torch
from torch import Tensor


def sort_rows(keys: Tensor) -> Tensor:
    """Int64 keys (R,N) sorted within each row; on the CPU by NumPy, which vectorises it."""
    if keys.is_cuda:
        return keys.sort(1).values
    return torch.from_numpy(np.sort(keys.numpy(), 1))


def stable_order(index: Tensor) -> Tensor:
    """The permutation (E,) that sorts non-negative int32 indices (E,) and keeps ties in order."""
    place = torch.arange(len(index), device=index.device)
    return sort_rows(((index.long() << 32) | place)[None])[0] & 0xFFFFFFFF
