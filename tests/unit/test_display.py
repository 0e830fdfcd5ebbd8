"""The sRGB curve of the standard, its inverse, and exact 8-bit steps."""

import numpy as np
import pytest

from vlnhijack import display


def test_known_values() -> None:
    assert display.decode(0.5) == pytest.approx(0.21404114, abs=1e-7)
    assert display.encode([-1, 0, 0.18, 1, 7]) == pytest.approx([0, 0, 0.46135613, 1, 1], abs=1e-6)
    assert display.decode(0.04) == pytest.approx(0.04 / 12.92)


def test_inverse_and_levels() -> None:
    levels = np.arange(256, dtype=np.uint8)
    values = display.from_8bit(levels)
    assert values.dtype == np.float32 and np.array_equal(values, levels / np.float32(255))
    assert np.array_equal(display.to_8bit(display.encode(display.decode(values))), levels)
    assert np.allclose(display.encode(display.decode(values)), values, atol=1e-6)
    assert (np.diff(display.decode(values)) > 0).all()
