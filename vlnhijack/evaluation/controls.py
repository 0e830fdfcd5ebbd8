"""Textures that an attack is compared with: random noise of the same strength."""

import numpy as np

from vlnhijack import seeds
from vlnhijack.threat import Texture, quantise

BLOCK = 16


def noise_textures(original: Texture, epsilon: float, seed: int) -> dict[str, Texture]:
    """±ε signs per texel, and per block of 16×16 texels, which survives minification.

    original (H,W,3); the results are 8-bit values inside the ε-ball.
    """
    return {
        "noise_texel": _signs(original, epsilon, 1, seed),
        "noise_block": _signs(original, epsilon, BLOCK, seed),
    }


def _signs(original: Texture, epsilon: float, block: int, seed: int) -> Texture:
    height, width, channels = original.shape
    rng = seeds.stream(seed, "noise", block)
    shape = (-(-height // block), -(-width // block), channels)
    signs = rng.choice((-1.0, 1.0), size=shape).astype(np.float32)
    signs = signs.repeat(block, 0).repeat(block, 1)[:height, :width]
    return quantise(original + np.float32(epsilon) * signs, original, epsilon)
