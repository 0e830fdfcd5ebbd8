import numpy as np
import pytest

from tests.houses import tiny_house
from vlnhijack.navigation.candidates import candidates
from vlnhijack.navigation.graph import NavigationGraph
from vlnhijack.navigation.views import view_angles


def star(*offsets: tuple[float, float, float]) -> NavigationGraph:
    """A viewpoint "o" at the origin joined to "a", "b", … at the offsets."""
    positions = np.array([(0.0, 0.0, 0.0), *offsets])
    adjacency = np.zeros((len(positions),) * 2, bool)
    adjacency[0, 1:] = adjacency[1:, 0] = True
    names = tuple("oabcdef"[: len(positions)])
    return NavigationGraph("star", names, positions, adjacency, np.ones(len(positions)))


def test_each_neighbour_is_seen_in_the_view_nearest_to_it() -> None:
    found = {c.viewpoint: c for c in candidates(star((0, 2, 0), (2, 0, 0), (0, -2, 2)))["o"]}
    assert (found["a"].point_id, found["b"].point_id, found["c"].point_id) == (12, 15, 30)
    assert found["b"].heading == pytest.approx(np.pi / 2, abs=1e-6)
    assert found["c"].elevation == pytest.approx(np.pi / 4, abs=1e-6)
    for candidate in found.values():
        heading, elevation = view_angles(candidate.point_id)
        gap = np.hypot(candidate.heading - heading, candidate.elevation - elevation)
        assert gap == pytest.approx(candidate.distance, abs=1e-6)


def test_the_order_is_that_of_first_sight() -> None:
    ahead_left, right, ahead = (-0.2, 2.0, 0.0), (2.0, 0.0, 0.0), (0.05, 2.0, 0.0)
    assert [c.viewpoint for c in candidates(star(right, ahead_left, ahead))["o"]] == ["c", "b", "a"]


def test_a_neighbour_straight_above_is_never_seen_and_an_isolated_viewpoint_has_none() -> None:
    found = candidates(star((0, 0, 2), (0, 2, 0)))
    assert [c.viewpoint for c in found["o"]] == ["b"]
    assert found["a"] == []
    assert candidates(star())["o"] == []


def test_candidates_of_a_house_are_the_neighbours() -> None:
    graph = tiny_house().graph
    for viewpoint, found in candidates(graph).items():
        assert {c.viewpoint for c in found} == set(graph.neighbours(viewpoint))
