import numpy as np
import pytest
import torch

from tests.hamt_by_hand import act, logits_along
from tests.worlds import World, world
from vlnhijack import seeds
from vlnhijack.agents.rollout import rollout
from vlnhijack.agents.trajectory import read_instructions
from vlnhijack.navigation.episode import Episode


@pytest.fixture(scope="module")
def given() -> World:
    return world(seed=3)


def walk(
    given: World,
    episodes: list[Episode],
    guides: list[list[str]],
    max_steps: int = 15,
    sampler: np.random.Generator | None = None,
) -> list[list[str]]:
    read = read_instructions(given.agent.policy, given.agent.reader, episodes)
    paths = rollout(
        given.agent.policy,
        given.table,
        given.features,
        read,
        [[given.table.index[e.scan, v] for v in g] for e, g in zip(episodes, guides, strict=True)],
        [episode.heading for episode in episodes],
        max_steps=max_steps,
        sampler=sampler,
    )
    return [[given.table.viewpoint(row) for row in path] for path in paths]


def test_a_batch_walks_as_each_of_its_episodes_alone(given: World) -> None:
    episodes = given.episodes[::19]
    guides = [list(e.path[: 1 + k % 3]) for k, e in enumerate(episodes)]
    expected = [
        act(given, e, guide, max_steps=6) for e, guide in zip(episodes, guides, strict=True)
    ]
    lengths = {len(path) - len(g) for path, g in zip(expected, guides, strict=True)}
    assert {0, 6} <= lengths, "some stop at once, some never"
    assert walk(given, episodes, guides, max_steps=6) == expected


def test_a_sampled_move_is_drawn_from_the_policy(given: World) -> None:
    count = 1500
    first = {e: logits_along(given, e, [e.path[0]])[0] for e in given.episodes[::9]}
    episode = min(first, key=lambda e: abs(first[e][1].softmax(0).max() - 0.7))
    step, logits = first[episode]
    expected = logits[: len(step.exits) + 1].softmax(0).numpy()
    paths = walk(
        given,
        [episode] * count,
        [[episode.path[0]]] * count,
        max_steps=1,
        sampler=seeds.stream(0, "sampler"),
    )
    ends = [*step.exits, None]
    counts = np.zeros(len(ends))
    for path in paths:
        counts[ends.index(path[1] if len(path) > 1 else None)] += 1
    spread = np.sqrt(expected * (1 - expected) / count)
    assert 0.6 < expected.max() < 0.8, "neither uniform nor certain"
    assert (np.abs(counts / count - expected) < 4 * spread + 1e-9).all()


def test_the_same_sampler_walks_the_same_paths(given: World) -> None:
    episodes = given.episodes[:5]
    starts = [list(e.path[:1]) for e in episodes]
    walks = [walk(given, episodes, starts, 8, seeds.stream(seed, "sampler")) for seed in (1, 1, 2)]
    assert walks[0] == walks[1] != walks[2]


def test_a_rollout_leaves_no_gradients(given: World) -> None:
    features = given.features.clone().requires_grad_()
    with torch.enable_grad():
        walk(given._replace(features=features), given.episodes[:1], [[given.episodes[0].path[0]]])
    assert features.grad is None
