import time

import numpy as np
import pytest

from vlnhijack.errors import InputError
from vlnhijack.frames import direction
from vlnhijack.scenes.procedural.furniture import (
    ATTACKABLE,
    CATEGORIES,
    Part,
    assemble,
    make_piece,
    place,
)
from vlnhijack.scenes.procedural.materials import solid
from vlnhijack.scenes.procedural.painting import paint
from vlnhijack.scenes.procedural.shapes import box
from vlnhijack.seeds import stream

LARGEST = {"curtain": (2.4, 0.3, 2.5), "sofa": (3.3, 1.8, 1.2), "shelf": (1.3, 0.5, 2.4)}
# (width, height) in metres that a large piece has at least
LARGE_AT_LEAST = {
    "chair": (0.85, 0.85),
    "cabinet": (1.2, 1.75),
    "table": (1.75, 0.7),
    "plant": (0.7, 1.45),
    "sofa": (1.9, 0.75),
    "tv_monitor": (1.3, 1.1),
}


@pytest.mark.parametrize("category", CATEGORIES)
def test_pieces_stand_on_the_floor_and_have_a_plausible_size(category: str) -> None:
    for index in range(6):
        piece = make_piece(category, stream(3, category, index), large=index % 2 == 1)
        low, high = piece.mesh.vertices.min(axis=0), piece.mesh.vertices.max(axis=0)
        assert low[2] == pytest.approx(0.0, abs=1e-9)
        assert np.allclose((low + high)[:2], 0.0, atol=1e-9)
        assert np.all(np.array(piece.size) <= LARGEST.get(category, (2.5, 2.25, 2.3)))
        assert 12 <= len(piece.mesh.faces) <= 3200
        assert piece.category == category
        corners = piece.mesh.vertices[piece.mesh.faces]
        doubled = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert np.linalg.norm(doubled, axis=1).min() > 1e-9, "a face without area"


@pytest.mark.parametrize("category", ATTACKABLE)
def test_large_pieces_are_large(category: str) -> None:
    width, height = LARGE_AT_LEAST[category]
    for index in range(12):
        size = make_piece(category, stream(4, category, index), large=True).size
        assert size[0] >= width
        assert size[2] >= height


@pytest.mark.parametrize("category", sorted(set(CATEGORIES) - {"plant", "table"}))
def test_parts_are_closed(category: str) -> None:
    faces = make_piece(category, stream(5, category)).mesh.faces
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    pairs = {(int(a), int(b)) for a, b in edges}
    assert len(pairs) == len(edges)
    assert all((b, a) in pairs for a, b in pairs)


@pytest.mark.parametrize("category", CATEGORIES)
def test_a_seed_gives_one_piece_and_another_seed_another(category: str) -> None:
    first, again, other = (make_piece(category, stream(6, category, i)) for i in (0, 0, 1))
    assert np.array_equal(first.mesh.vertices, again.mesh.vertices)
    points = np.random.default_rng(0).uniform(0, 1, (50, 3))
    shown = [p.parts[-1].material(points, points) for p in (first, again, other)]
    assert np.array_equal(shown[0], shown[1])
    same = first.mesh.vertices.shape == other.mesh.vertices.shape
    assert not (
        same
        and np.allclose(first.mesh.vertices, other.mesh.vertices)
        and all(
            np.allclose(p.material(points, points), q.material(points, points))
            for p, q in zip(first.parts, other.parts, strict=True)
        )
    )


def test_an_unknown_category_is_named() -> None:
    with pytest.raises(InputError, match="category: expected one of chair.*'yacht'"):
        make_piece("yacht", np.random.default_rng(0))


def test_place_turns_the_front_along_the_heading() -> None:
    front, rear = (0.9, 0.1, 0.1), (0.1, 0.1, 0.9)
    two = assemble(
        "test",
        Part(box(1.0, 0.2, 1.0, (0.0, 0.4, 0.0)), solid(front)),
        Part(box(1.0, 0.2, 1.0, (0.0, -0.4, 0.0)), solid(rear)),
    )
    for heading in (0.0, np.pi / 2, 2.0):
        surface = place(two, "two", "two-1", (3.0, 4.0, 0.5), heading, 64)
        centres = surface.vertices[surface.faces].mean(axis=1)
        along = (centres - [3.0, 4.0, 0.5]) @ direction(heading)
        middle = surface.uv[surface.faces].mean(axis=1)
        column, row = np.floor(middle * 64).astype(int).T
        assert (surface.texture[row, column, 0] > 0.5).tolist() == (along > 0).tolist()
        assert surface.vertices[:, 2].min() == pytest.approx(0.5)


def test_paint_evaluates_the_material_where_the_texel_lies() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    faces, uv = np.array([[0, 1, 2], [0, 2, 3]]), vertices[:, :2]
    texture = paint(vertices, faces, uv, np.array([0, 0]), [lambda p, n: (p + n) / 2], 16, 16)
    expected = (np.arange(16) + 0.5) / 32
    assert np.allclose(texture[:, :, 0], expected[None, :], atol=1e-6)
    assert np.allclose(texture[:, :, 1], expected[:, None], atol=1e-6)
    assert np.allclose(texture[:, :, 2], 0.5)


def test_placing_takes_under_a_second() -> None:
    pieces = [make_piece(c, stream(7, c), large=True) for c in ("plant", "cabinet", "sofa")]
    started = time.perf_counter()
    for piece in pieces:
        surface = place(piece, piece.category, "x", (0.0, 0.0, 0.0), 0.0, piece.texels)
        assert surface.texture.shape == (piece.texels, piece.texels, 3)
        assert surface.texture.std() > 0.02
    assert time.perf_counter() - started < 3 * len(pieces)
