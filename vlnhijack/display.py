"""The sRGB transfer function of lit houses (IEC 61966-2-1), exact and piecewise."""

import numpy as np
from numpy.typing import ArrayLike, NDArray


def encode(linear: ArrayLike) -> NDArray[np.float32]:
    """Display values in [0,1] of linear radiance, clipped to [0,1]; any shape."""
    x = np.clip(np.asarray(linear, np.float64), 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055).astype(np.float32)


def decode(display: ArrayLike) -> NDArray[np.float32]:
    """Linear values of display values in [0,1]; the inverse of `encode`."""
    x = np.asarray(display, np.float64)
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4).astype(np.float32)


def to_8bit(display: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Display values rounded to the nearest of 256 levels."""
    return np.round(np.clip(display, 0, 1) * 255).astype(np.uint8)


def from_8bit(levels: NDArray[np.uint8]) -> NDArray[np.float32]:
    """The float32 display values levels / 255."""
    return levels.astype(np.float32) / np.float32(255)
