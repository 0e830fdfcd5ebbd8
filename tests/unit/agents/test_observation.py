import numpy as np
import pytest
import torch

from tests.hamt_by_hand import Step
from tests.worlds import World, world
from vlnhijack.agents.observation import VIEWS, gather_views, observation_table
from vlnhijack.errors import InputError
from vlnhijack.navigation.graph import NavigationGraph
from vlnhijack.navigation.views import angle_features


@pytest.fixture(scope="module")
def given() -> World:
    return world()


def test_tokens_are_those_of_hamt(given: World) -> None:
    table = given.table
    keys = list(table.index)
    views = torch.arange(len(keys)) * 7 % VIEWS
    seen = table.observe(torch.arange(len(keys)), views)
    images = gather_views(given.features, torch.arange(len(keys)), seen.rows)
    for row, (scan, viewpoint) in enumerate(keys):
        step = Step(given, scan, viewpoint, int(views[row]))
        count = len(step.types)
        assert seen.mask[row].tolist() == [True] * count + [False] * (len(seen.mask[row]) - count)
        assert torch.equal(seen.nav_types[row, :count], step.types)
        assert torch.equal(images[row, :count], step.images)
        torch.testing.assert_close(seen.angles[row, :count], step.angles, rtol=0, atol=2e-6)


def test_padding_is_blank(given: World) -> None:
    rows = torch.arange(len(given.table.index))
    seen = given.table.observe(rows, torch.zeros_like(rows))
    padding = ~seen.mask
    assert padding.any()
    assert not seen.nav_types[padding].any()
    assert not seen.angles[padding].any()
    assert not gather_views(given.features, rows, seen.rows)[padding].any()


def test_a_neighbour_in_the_east_seen_by_an_agent_that_looks_east() -> None:
    positions = np.array([[0.0, 0, 0], [2, 0, 0]])
    graph = NavigationGraph("pair", ("a", "b"), positions, ~np.eye(2, dtype=bool), np.ones(2))
    table = observation_table([graph])
    east = table.observe(torch.tensor([0]), torch.tensor([15]))
    north = table.observe(torch.tensor([0]), torch.tensor([12]))
    assert east.rows[0, :2].tolist() == [15, VIEWS]
    torch.testing.assert_close(east.angles[0, 0], torch.tensor([0.0, 1, 0, 1]))
    torch.testing.assert_close(north.angles[0, 0], torch.tensor([1.0, 0, 0, 1]), rtol=0, atol=1e-6)


def test_actions_lead_where_they_say(given: World) -> None:
    table = given.table
    for (scan, viewpoint), row in table.index.items():
        graph = table.graphs[scan]
        for neighbour in graph.neighbours(viewpoint):
            target = table.index[scan, neighbour]
            action = table.actions(torch.tensor([row]), torch.tensor([target]))
            assert table.targets[row, action].item() == target
            assert table.viewpoint(target) == neighbour
        stop = table.actions(torch.tensor([row]), torch.tensor([-1]))
        assert stop.item() == len(graph.neighbours(viewpoint)) == table.stops[row]
        assert table.nav_types[row, stop].item() == 2


def test_angles_of_the_panorama_turn_with_the_agent(given: World) -> None:
    for base in (0, 13, 30):
        assert torch.equal(
            given.table.view_angle_features[base], torch.from_numpy(angle_features(base))
        )


def test_gradients_reach_the_gathered_views_only(given: World) -> None:
    features = given.features.clone().requires_grad_()
    rows = torch.tensor([[3, VIEWS, 3]])
    gather_views(features, torch.tensor([2]), rows).sum().backward()
    expected = torch.zeros_like(features)
    expected[2, 3] = 2
    assert features.grad is not None
    assert torch.equal(features.grad, expected)


def test_a_step_to_no_neighbour_is_refused(given: World) -> None:
    scan, viewpoint = next(iter(given.table.index))
    graph = given.table.graphs[scan]
    far = next(v for v in graph.viewpoints if v not in {viewpoint, *graph.neighbours(viewpoint)})
    with pytest.raises(InputError, match=f"a neighbour of {viewpoint}, received '?{far}"):
        given.table.actions(torch.tensor([0]), torch.tensor([given.table.index[scan, far]]))
