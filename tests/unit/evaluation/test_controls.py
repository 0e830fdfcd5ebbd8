import numpy as np
import pytest

from vlnhijack import seeds
from vlnhijack.display import from_8bit
from vlnhijack.evaluation.controls import noise_textures
from vlnhijack.threat import violation

EPSILON = 0.2


@pytest.fixture
def original() -> np.ndarray:
    """Texels far from black and white in the first rows, close to white in the last."""
    levels = seeds.stream(0, "controls").integers(60, 190, (40, 52, 3))
    levels[30:] = 255
    return from_8bit(levels.astype(np.uint8))


def test_noise_is_epsilon_where_nothing_clamps_it(original: np.ndarray) -> None:
    for name, texture in noise_textures(original, EPSILON, seed=1).items():
        change = texture.astype(float) - original
        assert np.abs(change[:30]) == pytest.approx(np.full_like(change[:30], EPSILON), abs=1e-6)
        assert change.max() <= EPSILON + 1e-6
        assert texture.max() <= 1
        assert violation(texture, original, EPSILON) <= 1e-6, name
        assert (change[30:] <= 0).all()


def test_blocks_share_their_sign_and_texels_do_not(original: np.ndarray) -> None:
    noise = noise_textures(original, EPSILON, seed=1)
    up = {name: texture[:30] > original[:30] for name, texture in noise.items()}
    blocks = up["noise_block"]
    for row in range(0, 30, 16):
        for column in range(0, 52, 16):
            block = blocks[row : row + 16, column : column + 16].reshape(-1, 3)
            assert (block == block[0]).all()
    assert any((blocks[:, k] != blocks[:, k - 1]).any() for k in (16, 32, 48))
    texels = up["noise_texel"]
    assert texels.mean() == pytest.approx(0.5, abs=0.05)
    assert (texels[:, 1:] != texels[:, :-1]).mean() == pytest.approx(0.5, abs=0.05)


def test_the_seed_decides(original: np.ndarray) -> None:
    first, again, other = (noise_textures(original, EPSILON, seed) for seed in (1, 1, 2))
    for name, texture in first.items():
        assert (texture == again[name]).all()
        assert (texture != other[name]).any()
