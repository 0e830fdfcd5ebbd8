from itertools import pairwise
from pathlib import Path

import pytest

from tests.box_house import box_house
from vlnhijack.navigation.episode import Episode, load_episodes, save_episodes
from vlnhijack.scenes.procedural.episodes import make_episodes, viewpoint_overlap

HOUSE = box_house()
TRAIN, VAL = make_episodes(HOUSE, seed=0, train_paths=60, val_paths=12)


def paths(episodes: list[Episode]) -> set[tuple[str, ...]]:
    return {episode.path for episode in episodes}


def test_there_are_three_instructions_for_every_path() -> None:
    assert (len(paths(TRAIN)), len(paths(VAL))) == (60, 12)
    assert (len(TRAIN), len(VAL)) == (180, 36)
    assert len({episode.instruction_id for episode in TRAIN + VAL}) == 216
    for first in range(0, len(TRAIN), 3):
        assert len({episode.instruction for episode in TRAIN[first : first + 3]}) == 3


def test_paths_are_shortest_and_of_the_right_length() -> None:
    graph = HOUSE.graph
    for path in paths(TRAIN + VAL):
        length = sum(graph.distance(a, b) for a, b in pairwise(path))
        assert 4 <= len(path) <= 7 and length >= 5
        assert length == pytest.approx(graph.distance(path[0], path[-1]))


def test_no_val_seen_path_is_a_part_of_a_train_path() -> None:
    for held_out in paths(VAL):
        for path in paths(TRAIN):
            parts = (path[i : i + len(held_out)] for i in range(len(path)))
            assert held_out not in set(parts)


def test_train_paths_spread_over_the_directed_edges() -> None:
    used = {edge for path in paths(TRAIN) for edge in pairwise(path)}
    every, _ = make_episodes(HOUSE, seed=0, train_paths=10_000, val_paths=1)
    assert len(used) > 0.8 * len({edge for path in paths(every) for edge in pairwise(path)})


def test_the_overlap_of_viewpoints() -> None:
    assert 0.8 < viewpoint_overlap(TRAIN, VAL) <= 1
    assert viewpoint_overlap(VAL, VAL) == 1
    assert viewpoint_overlap([], VAL) == 0


def test_episodes_depend_on_the_seed_alone_and_survive_a_file(tmp_path: Path) -> None:
    assert make_episodes(HOUSE, seed=0, train_paths=60, val_paths=12) == (TRAIN, VAL)
    assert make_episodes(HOUSE, seed=1, train_paths=60, val_paths=12) != (TRAIN, VAL)
    save_episodes(tmp_path / "train.json", TRAIN)
    assert load_episodes(tmp_path / "train.json", {HOUSE.graph.scan: HOUSE.graph}) == TRAIN
