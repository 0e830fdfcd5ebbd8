import numpy as np
import trimesh

from vlnhijack.scenes.lookouts import lookouts


def _board(height: float) -> trimesh.Trimesh:
    """A board 2 m wide from the floor up, its front in the plane y = 0."""
    board = trimesh.creation.box((2.0, 0.02, height))
    board.apply_translation((0.0, -0.01, height / 2))
    return board


def test_only_places_from_which_it_fills_half_of_a_view() -> None:
    distances = np.arange(0.1, 3.0, 0.1)
    places = np.column_stack([0 * distances, distances, np.full(len(distances), 1.5)])
    rows = lookouts(places, _board(1.2), np.random.default_rng(0))
    assert len(rows)
    for distance in distances[rows]:
        top = np.tan(np.pi / 6 - np.arctan2(0.3, distance)) / np.tan(np.pi / 6)
        assert 0.3 < (1 + top) / 2 < 0.8
    assert len(lookouts(places, _board(0.2), np.random.default_rng(0))) == 0


def test_places_far_away_are_left_out() -> None:
    places = np.array([[0.0, 5.0, 1.5]])
    assert len(lookouts(places, _board(2.0), np.random.default_rng(0))) == 0
