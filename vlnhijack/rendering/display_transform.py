"""The transfer function of `vlnhijack.display` on tensors, differentiable."""

import torch
from torch import Tensor


def decode(display: Tensor) -> Tensor:
    """Linear values of display values."""
    high = ((display.clamp_min(0.04045) + 0.055) / 1.055) ** 2.4
    return torch.where(display <= 0.04045, display / 12.92, high)


def encode(linear: Tensor) -> Tensor:
    """Display values of linear values, clipped to [0,1]."""
    x = linear.clamp(0, 1)
    high = 1.055 * x.clamp_min(0.0031308) ** (1 / 2.4) - 0.055
    return torch.where(x <= 0.0031308, 12.92 * x, high)
