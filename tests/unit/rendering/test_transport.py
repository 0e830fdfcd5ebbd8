"""The sparse operator as a pure function of hits; Mitsuba is not needed."""

import numpy as np
import torch
from scipy.ndimage import map_coordinates

from vlnhijack.rendering.transport import Transport, assemble, bilinear, transport_rows

SHAPE = (6, 8, 3)
PIXELS = 20


def _operator(seed: int = 0, hits: int = 300) -> Transport:
    random = np.random.default_rng(seed)
    pixel = random.integers(0, PIXELS - 3, hits)
    uv = random.random((hits, 2), np.float32)
    return assemble([transport_rows(pixel, uv, 1 / 16, PIXELS, SHAPE)], SHAPE)


def test_bilinear_is_a_clamped_lookup_at_half_texels() -> None:
    random = np.random.default_rng(0)
    texture = random.random((6, 8))
    uv = random.uniform(-0.1, 1.1, (500, 2)).astype(np.float32)
    texel, weight = bilinear(uv, 6, 8)
    where = np.stack([uv[:, 1] * 6 - 0.5, uv[:, 0] * 8 - 0.5])
    expected = map_coordinates(texture, where, order=1, mode="nearest")
    np.testing.assert_allclose((texture.ravel()[texel] * weight).sum(1), expected, atol=1e-6)


def test_hits_of_one_pixel_and_texel_are_merged() -> None:
    pixel, uv = np.array([2, 2, 5]), np.full((3, 2), 0.5, np.float32)
    rows = transport_rows(pixel, uv, 0.25, PIXELS, SHAPE)
    assert rows.nnz == 8
    np.testing.assert_allclose(rows.sum(1)[[2, 5]], [0.5, 0.25])


def test_parts_lie_below_one_another() -> None:
    random = np.random.default_rng(1)
    pixel, uv = np.sort(random.integers(0, PIXELS, 100)), random.random((100, 2), np.float32)
    split = int(np.searchsorted(pixel, 10))
    parts = [
        transport_rows(pixel[:split], uv[:split], 1.0, 10, SHAPE),
        transport_rows(pixel[split:] - 10, uv[split:], 1.0, 10, SHAPE),
    ]
    whole = assemble([transport_rows(pixel, uv, 1.0, PIXELS, SHAPE)], SHAPE)
    texture = torch.rand(SHAPE)
    torch.testing.assert_close(assemble(parts, SHAPE)(texture), whole(texture))


def test_only_texels_that_are_seen_are_columns() -> None:
    uv = np.full((4, 2), 0.5, np.float32)
    operator = assemble([transport_rows(np.arange(4), uv, 1.0, PIXELS, SHAPE)], SHAPE)
    assert operator.texels.tolist() == [2 * 8 + 3, 2 * 8 + 4, 3 * 8 + 3, 3 * 8 + 4]
    assert operator.forward.shape == (PIXELS, 4)


def test_adjoint_identity() -> None:
    operator = _operator().double()
    texture = torch.rand(SHAPE, dtype=torch.float64, requires_grad=True)
    weights = torch.rand(PIXELS, 3, dtype=torch.float64)
    image = operator(texture)
    (gradient,) = torch.autograd.grad(image, texture, weights)
    torch.testing.assert_close((image * weights).sum(), (texture * gradient).sum())


def test_float64_finite_differences() -> None:
    texture = torch.rand(SHAPE, dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(_operator().double(), texture)


def test_unseen_texels_get_no_gradient() -> None:
    uv = np.full((4, 2), 0.5, np.float32)
    operator = assemble([transport_rows(np.arange(4), uv, 1.0, PIXELS, SHAPE)], SHAPE)
    texture = torch.rand(SHAPE, requires_grad=True)
    operator(texture).sum().backward()
    assert texture.grad is not None
    assert (texture.grad.flatten(0, 1).sum(1) > 0).nonzero().ravel().tolist() == [19, 20, 27, 28]
