import re

import pytest
import torch

from tests.worlds import World, world
from vlnhijack.errors import InputError
from vlnhijack.evaluation.ablations import (
    ablate,
    blank_features,
    rates,
    replace_words,
    shuffle_instructions,
)
from vlnhijack.navigation.episode import Episode

OBJECTS = {"chair": "chair", "armchair": "chair", "lamp": "lamp", "lamp stand": "lamp"}
ROOMS = {"kitchen": "kitchen", "hall": "hallway", "hallway": "hallway"}
GROUPS = (OBJECTS, ROOMS)


@pytest.fixture(scope="module")
def given() -> World:
    return world()


def instructions(text: str, count: int = 40) -> list[Episode]:
    return [Episode(k, "s", ("a",), 0.0, text, f"{k}_0", 0.0) for k in range(count)]


def test_a_shuffled_instruction_is_that_of_another_path_of_the_scan(given: World) -> None:
    episodes = given.episodes[::5]
    shuffled = shuffle_instructions(episodes, seed=0)
    owners: dict[tuple[str, str], set[int]] = {}
    for episode in episodes:
        owners.setdefault((episode.scan, episode.instruction), set()).add(episode.path_id)
    for before, after in zip(episodes, shuffled, strict=True):
        assert after.path == before.path
        assert owners[before.scan, after.instruction] - {before.path_id}
    assert len({after.instruction for after in shuffled}) > 10


def test_a_single_path_has_no_other_instruction() -> None:
    with pytest.raises(InputError, match="paths of s: expected two or more"):
        shuffle_instructions(instructions("Stop.", 1), seed=0)


def test_object_and_room_words_change_their_category_and_no_other_word_changes() -> None:
    text = "Pass the armchair and the lamp stand, then enter the hallway; chairlift."
    replaced = [e.instruction for e in replace_words(instructions(text), GROUPS, seed=0)]
    pattern = re.compile(r"Pass the (.+) and the (.+), then enter the (.+); chairlift\.")
    found = [pattern.fullmatch(sentence) for sentence in replaced]
    words = [match.groups() for match in found if match]
    assert len(words) == len(replaced)
    assert {seat for seat, _, _ in words} == {"lamp", "lamp stand"}
    assert {light for _, light, _ in words} == {"chair", "armchair"}
    assert {room for _, _, room in words} == {"kitchen"}


def test_words_are_found_in_any_case() -> None:
    replaced = replace_words(instructions("Chair. Stop at the KITCHEN", 1), GROUPS, seed=0)
    assert replaced[0].instruction in (
        f"{light}. Stop at the {room}" for light in ("lamp", "lamp stand") for room in ROOMS
    )


def test_a_blank_view_is_grey_for_every_view(given: World) -> None:
    blank = blank_features(given.agent, given.features)
    assert blank.shape == given.features.shape
    expected = given.agent.encoder(torch.full((1, 3, 8, 12), 0.5))[0]
    assert (blank == expected).all()


def test_every_ablation_takes_one_thing_away(given: World) -> None:
    episodes = given.episodes[::9]
    found = ablate(given.agent, given.table, given.features, episodes, GROUPS, seed=0)
    given_alone = (given.agent, given.table)
    assert found == {
        "clean": rates(*given_alone, given.features, episodes),
        "shuffled": rates(*given_alone, given.features, shuffle_instructions(episodes, 0)),
        "blank": rates(*given_alone, blank_features(given.agent, given.features), episodes),
        "words": rates(*given_alone, given.features, replace_words(episodes, GROUPS, 0)),
    }
    assert {row["n"] for row in found.values()} == {len(episodes)}
    assert len({row["ndtw"] for row in found.values()}) == 4
