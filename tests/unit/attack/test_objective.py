from typing import cast

import pytest
import torch

from tests.hamt_by_hand import logits_along
from tests.worlds import World, world
from vlnhijack.attack.attacked_views import AttackedViews
from vlnhijack.attack.objective import Objective, attack_objective
from vlnhijack.navigation.episode import Episode
from vlnhijack.rendering.renderer import Renderer
from vlnhijack.threat import AttackInstance, guide

WHERE = "east06"


@pytest.fixture(scope="module")
def given() -> World:
    return world()


def instance(given: World, trajectory: tuple[str, ...]) -> AttackInstance:
    through = tuple(e for e in given.episodes if WHERE in e.path)[::5]
    assert len({e.path.index(WHERE) for e in through}) > 2
    return AttackInstance(
        "a", "east", "chair_0", "chair", WHERE, 0.5, trajectory, through, through, through
    )


def naive_loss(given: World, attack: AttackInstance, episode: Episode) -> float:
    """−log p of every action from v_ATK on, walked one by one."""
    before = guide(attack, episode)
    path = [*before, *attack.trajectory]
    steps = logits_along(given, episode, path)[len(before) - 1 :]
    targets = [*attack.trajectory, None]
    return -sum(
        logits.log_softmax(0)[step.action(target)].item()
        for (step, logits), target in zip(steps, targets, strict=True)
    )


def build(given: World, attack: AttackInstance) -> Objective:
    """The objective for textures that change what is seen at every step of the attack."""
    changing = torch.tensor([given.table.index[attack.scan, v] for v in attack.target_path])
    front = torch.full_like(changing, 12)
    unused = cast(Renderer, None)
    views = AttackedViews(unused, given.agent.encoder, given.features, changing, front)
    return attack_objective(given.agent, given.table, attack, attack.train, views)


@pytest.mark.parametrize("trajectory", [(), ("east02", "east03")], ids=["stop", "trajectory"])
def test_loss_is_the_sum_over_attack_steps(given: World, trajectory: tuple[str, ...]) -> None:
    attack = instance(given, trajectory)
    objective = build(given, attack)
    order = torch.tensor([3, 0, 3, 5, 1, 2, 4, 0, 5])
    expected = torch.tensor([naive_loss(given, attack, attack.train[row]) for row in order])
    torch.testing.assert_close(objective(given.features, order), expected, rtol=1e-4, atol=1e-4)


def test_gradients_reach_the_attacked_steps_and_the_history(given: World) -> None:
    attack = instance(given, ("east02", "east03"))
    features = given.features.clone().requires_grad_()
    build(given, attack)(features, torch.tensor([2])).sum().backward()
    assert features.grad is not None
    moved = features.grad.abs().amax((1, 2)) > 0
    assert {given.table.viewpoint(row) for row in moved.nonzero()[:, 0].tolist()} == set(
        attack.target_path
    )
