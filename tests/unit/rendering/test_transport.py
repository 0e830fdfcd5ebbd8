"""The sparse operator of given hits, against its float64 twin (tests/transport_twin.py)."""

from itertools import product

import numpy as np
import pytest
import torch

from tests.transport_twin import Hit, dense_operator
from vlnhijack.errors import InputError
from vlnhijack.rendering.filters import Filters, film_filter
from vlnhijack.rendering.samples import border_of
from vlnhijack.rendering.trace import Met, Samples
from vlnhijack.rendering.transport import Transport, build
from vlnhijack.rendering.variant import activate

SIZE, VIEWS, SPP = (5, 4), 2, 4
SHAPE = (3, 6, 3)
CHOICES = [
    Filters(film, lookup, wrap)
    for film, lookup, wrap in product(
        ("box", "gaussian"), ("bilinear", "nearest"), ("clamp", "repeat", "mirror")
    )
    if film == "box" or wrap == "clamp"
]


def _hits(filters: Filters) -> list[Hit]:
    """Rays in film order; uv beyond the texture, two thirds of the rays hit, the last view less."""
    random = np.random.default_rng(0)
    border = border_of(filters.film)
    return [
        Hit(
            view,
            x + random.integers(1024) / 1024,
            y + random.integers(1024) / 1024,
            tuple(random.uniform(-1.2, 2.2, 2).astype(np.float32).tolist())
            if random.random() < (0.7, 0.1)[view]
            else None,
        )
        for view in range(VIEWS)
        for y in range(-border, SIZE[1] + border)
        for x in range(-border, SIZE[0] + border)
        for _ in range(SPP)
    ]


def _samples(hits: list[Hit], filters: Filters, views: int = VIEWS) -> Samples:
    mi = activate()
    border = border_of(filters.film)
    full = SIZE[1] + 2 * border
    position = np.float32([[hit.x + border, hit.view * full + hit.y + border] for hit in hits])
    uv = np.float32([hit.uv or (0, 0) for hit in hits])
    light = mi.Float(np.float32([hit.light if hit.uv else 0 for hit in hits]))
    rest = mi.Color3f(np.float32([[0 if hit.uv else 0.5] * 3 for hit in hits]).T)
    met = Met(mi.Point2f(uv.T), [light], rest)
    return Samples(0, views, SIZE, SPP, mi.Point2f(position.T), met)


def _build(filters: Filters, max_memory: float = 100) -> tuple[Transport, torch.Tensor]:
    return build([_samples(_hits(filters), filters)], SHAPE, filters, max_memory)


def _twin(filters: Filters) -> np.ndarray:
    film = None
    if filters.film == "gaussian":
        mi, kernel = activate(), film_filter(filters)

        def film(distance: float) -> float:
            return float(np.array(kernel.eval(mi.Float(distance)))[0])

    return dense_operator(
        _hits(filters), VIEWS, SIZE, SHAPE[:2], filters.lookup, filters.wrap, film
    )


def _dense(transport: Transport) -> np.ndarray:
    return transport.forward.to_dense().numpy()


@pytest.mark.parametrize("filters", CHOICES, ids=str)
def test_the_operator_and_its_gradient_are_the_twins(filters: Filters) -> None:
    transport, _ = _build(filters)
    twin = _twin(filters)
    np.testing.assert_allclose(_dense(transport), twin, atol=1e-6)
    texture = torch.rand(SHAPE, generator=torch.Generator().manual_seed(1)).requires_grad_()
    weights = torch.rand(len(twin), 3, generator=torch.Generator().manual_seed(2))
    (gradient,) = torch.autograd.grad(transport(texture), texture, weights)
    expected = (twin.T @ weights.double().numpy()).reshape(SHAPE)
    assert np.abs(gradient.numpy() - expected).max() <= 1e-6 * np.abs(expected).max()


@pytest.mark.parametrize("film", ["box", "gaussian"])
def test_rows_and_background_share_the_pixel(film: str) -> None:
    """Half the rays' weight that misses the object is background of radiance ½."""
    transport, background = _build(Filters(film))  # type: ignore[arg-type]
    covered = transport(torch.ones(SHAPE))
    torch.testing.assert_close(covered, 1 - 2 * background, atol=1e-6, rtol=0)
    assert 0 < covered.mean() < 1


@pytest.mark.parametrize("film", ["box", "gaussian"])
def test_tiles_change_no_bit(film: str) -> None:
    filters = Filters(film)  # type: ignore[arg-type]
    whole, tiled = _build(filters)[0], _build(filters, 1e-9)[0]
    for a, b in ((whole.forward, tiled.forward), (whole.adjoint, tiled.adjoint)):
        assert torch.equal(a.crow_indices(), b.crow_indices())
        assert torch.equal(a.col_indices(), b.col_indices())
        assert torch.equal(a.values(), b.values())


def test_indices_are_int32_and_no_pair_occurs_twice() -> None:
    forward = _build(Filters())[0].forward
    assert forward.crow_indices().dtype == forward.col_indices().dtype == torch.int32
    place = forward.to_sparse_coo().indices()
    assert len(torch.unique(place, dim=1).T) == forward.values().numel() > 50


def test_only_the_views_that_count_have_rows() -> None:
    """A run is filled up with its last camera."""
    filters = Filters()
    transport, background = build([_samples(_hits(filters), filters, 1)], SHAPE, filters, 100)
    assert transport.forward.shape[0] == len(background) == SIZE[0] * SIZE[1]
    np.testing.assert_allclose(_dense(transport), _twin(filters)[: len(background)], atol=1e-6)


def test_coloured_light_weighs_each_channel() -> None:
    filters, colours = Filters(), (1.0, 2.0, 0.5)
    grey = _samples(_hits(filters), filters)
    coloured = Samples(
        0,
        VIEWS,
        SIZE,
        SPP,
        grey.position,
        grey.met._replace(light=[c * grey.met.light[0] for c in colours]),
    )
    texture = torch.rand(SHAPE, generator=torch.Generator().manual_seed(1)).requires_grad_()
    expected = build([grey], SHAPE, filters, 100)[0](texture) * torch.tensor(colours)
    transport, _ = build([coloured], SHAPE, filters, 100)
    assert transport.forward.shape == (3 * len(expected), 3 * SHAPE[0] * SHAPE[1])
    torch.testing.assert_close(transport(texture), expected)
    weights = torch.rand(expected.shape, generator=torch.Generator().manual_seed(2))
    gradients = [
        torch.autograd.grad(x, texture, weights)[0] for x in (transport(texture), expected)
    ]
    torch.testing.assert_close(*gradients)


def test_an_object_in_no_view_gives_black_and_no_gradient() -> None:
    filters = Filters()
    hits = [hit._replace(uv=None) for hit in _hits(filters)]
    transport, background = build([_samples(hits, filters)], SHAPE, filters, 100)
    texture = torch.rand(SHAPE, requires_grad=True)
    image = transport(texture)
    assert image.shape == background.shape
    (gradient,) = torch.autograd.grad(image.sum(), texture)
    assert not image.any() and not gradient.any()
    assert transport.texels.numel() == 0


def test_adjoint_identity_and_finite_differences() -> None:
    transport = _build(Filters())[0].double()
    texture = torch.rand(SHAPE, dtype=torch.float64, requires_grad=True)
    weights = torch.rand(len(transport.forward), 3, dtype=torch.float64)
    image = transport(texture)
    (gradient,) = torch.autograd.grad(image, texture, weights)
    torch.testing.assert_close((image * weights).sum(), (texture * gradient).sum())
    assert torch.autograd.gradcheck(transport, texture)


def test_an_unknown_filter_is_named() -> None:
    with pytest.raises(InputError, match="lookup: expected one of .*'bicubic'"):
        Filters(lookup="bicubic")  # type: ignore[arg-type]
