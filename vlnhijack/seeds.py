"""Named random streams, all derived from one seed.

Two streams with different names are independent, and adding a stream never changes another.
"""

import hashlib

import numpy as np


def integer(seed: int, *names: str | int) -> int:
    """A 32-bit integer that depends on the seed and on every name."""
    text = "/".join([str(seed), *map(str, names)])
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:4], "little")


def stream(seed: int, *names: str | int) -> np.random.Generator:
    """The random generator named by `names` under `seed`."""
    return np.random.default_rng(integer(seed, *names))
