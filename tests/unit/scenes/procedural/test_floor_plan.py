from itertools import combinations

import networkx as nx
import numpy as np
import pytest

from vlnhijack.scenes.procedural.floor_plan import WALL_THICKNESS, FloorPlan, make_floor_plan

SEEDS = range(12)


@pytest.fixture(params=SEEDS, scope="module")
def plan(request: pytest.FixtureRequest) -> FloorPlan:
    return make_floor_plan(np.random.default_rng(request.param))


def test_rooms_are_apart_by_a_wall(plan: FloorPlan) -> None:
    for a, b in combinations([room.bounds for room in plan.rooms], 2):
        gap = max(a[0] - b[2], b[0] - a[2], a[1] - b[3], b[1] - a[3])
        assert gap >= WALL_THICKNESS - 1e-9


def test_rooms_are_usable_and_labelled(plan: FloorPlan) -> None:
    labels = [room.label for room in plan.rooms]
    assert 5 <= len(labels) <= 8
    assert {"living room", "kitchen", "bedroom", "bathroom"} <= set(labels)
    assert labels.count("bedroom") <= 2
    assert len({room.id for room in plan.rooms}) == len(labels)
    sides = [(x1 - x0, y1 - y0) for x0, y0, x1, y1 in (room.bounds for room in plan.rooms)]
    assert min(map(min, sides)) > 1.6
    assert 2.6 <= plan.height <= 2.8


def test_doorways_connect_all_rooms_with_loops(plan: FloorPlan) -> None:
    graph = nx.Graph(doorway.rooms for doorway in plan.doorways)
    assert len(graph) == len(plan.rooms)
    assert nx.is_connected(graph)
    assert graph.size() == len(plan.doorways) > len(plan.rooms)


def test_doorways_open_the_wall_between_their_rooms(plan: FloorPlan) -> None:
    for doorway in plan.doorways:
        first, second = (plan.rooms[room].bounds for room in doorway.rooms)
        axis, along = doorway.axis, 1 - doorway.axis
        assert first[axis + 2] == pytest.approx(doorway.wall - WALL_THICKNESS / 2)
        assert second[axis] == pytest.approx(doorway.wall + WALL_THICKNESS / 2)
        assert 0.9 <= doorway.width <= 1.2
        for bounds in (first, second):
            assert bounds[along] + 0.3 < doorway.centre - doorway.width / 2
            assert doorway.centre + doorway.width / 2 < bounds[along + 2] - 0.3


def test_windows_are_in_outer_walls(plan: FloorPlan) -> None:
    bounds = np.array([room.bounds for room in plan.rooms])
    outer = [bounds[:, 0].min(), bounds[:, 1].min(), bounds[:, 2].max(), bounds[:, 3].max()]
    assert plan.windows
    for window in plan.windows:
        side = window.axis + (2 if window.sign > 0 else 0)
        along = 1 - window.axis
        assert bounds[window.room, side] == pytest.approx(outer[side])
        assert bounds[window.room, along] < window.centre - window.width / 2
        assert window.centre + window.width / 2 < bounds[window.room, along + 2]
        assert window.sill < window.head < plan.height
