import copy
from collections.abc import Iterator

import numpy as np
import pytest
import torch
from torch import Tensor

from tests.worlds import World, world
from vlnhijack.agents.hamt import Hamt
from vlnhijack.agents.training.imitation import (
    ImitationSchedule,
    Lessons,
    NextHop,
    smoothed_cross_entropy,
    train_policy,
)
from vlnhijack.errors import CheckError

SCHEDULE = ImitationSchedule(steps=30, batch=8, forced=0.5, lr=1e-2, longest_sample=4)


@pytest.fixture(scope="module")
def given() -> World:
    return world()


def test_labels_follow_the_shortest_path_of_every_pair(given: World) -> None:
    next_hop, table = NextHop(given.table), given.table
    for (scan, here), row in table.index.items():
        for (other, goal), goal_row in table.index.items():
            if other != scan:
                continue
            path = table.graphs[scan].shortest_path(here, goal)
            expected = table.index[scan, path[1]] if len(path) > 1 else -1
            assert next_hop(row, goal_row) == expected, (here, goal)


def naive_cross_entropy(logits: Tensor, targets: Tensor, smoothing: float) -> float:
    losses = []
    for row, target in zip(logits.tolist(), targets.tolist(), strict=True):
        scores = np.exp(np.array(row))
        p = scores / scores.sum()
        valid = [k for k, logit in enumerate(row) if np.isfinite(logit)]
        label = {k: smoothing / len(valid) + (1 - smoothing) * (k == target) for k in valid}
        losses.append(-sum(label[k] * np.log(p[k]) for k in valid))
    return float(np.mean(losses))


@pytest.mark.parametrize("smoothing", [0.0, 0.1, 0.5])
def test_smoothing_spreads_over_valid_actions_only(smoothing: float) -> None:
    logits = torch.randn(4, 6, generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    logits[0, 3:] = logits[1, 0] = logits[2, 1:] = -torch.inf
    targets = torch.tensor([2, 5, 0, 4])
    logits.requires_grad_()
    loss = smoothed_cross_entropy(logits, targets, smoothing)
    loss.backward()
    assert loss.item() == pytest.approx(naive_cross_entropy(logits.detach(), targets, smoothing))
    assert logits.grad is not None
    assert torch.isfinite(logits.grad).all()
    assert not logits.grad[logits == -torch.inf].any()


def student(given: World) -> tuple[Hamt, torch.optim.Optimizer]:
    torch.manual_seed(0)
    policy = Hamt(given.agent.policy.config)
    return policy, torch.optim.AdamW(policy.parameters())


def lessons(given: World) -> Lessons:
    return Lessons(given.table, given.features, given.agent.reader, given.episodes[::40])


def learn(
    given: World, policy: Hamt, optimiser: torch.optim.Optimizer, first: int = 0
) -> Iterator[tuple[int, float]]:
    return train_policy(policy, lessons(given), SCHEDULE, 5, optimiser, first_step=first)


def test_training_lowers_the_loss_and_a_resumed_one_repeats_it(given: World) -> None:
    policy, optimiser = student(given)
    losses, kept = [], None
    for step, loss in learn(given, policy, optimiser):
        losses.append(loss)
        if step == 14:
            kept = copy.deepcopy((policy, optimiser.state_dict()))
    assert np.mean(losses[-4:]) < 0.9 * np.mean(losses[:4])
    assert not policy.training

    assert kept is not None
    resumed = kept[0]
    optimiser = torch.optim.AdamW(resumed.parameters())
    optimiser.load_state_dict(kept[1])
    torch.rand(3)
    rest = list(learn(given, resumed, optimiser, first=14))
    assert [step for step, _ in rest] == list(range(15, 31))
    assert [loss for _, loss in rest] == losses[14:]
    for ours, theirs in zip(resumed.parameters(), policy.parameters(), strict=True):
        assert torch.equal(ours, theirs)


def test_a_loss_that_is_not_finite_is_an_error(given: World) -> None:
    policy, optimiser = student(given)
    broken = given._replace(features=torch.full_like(given.features, torch.nan))
    with pytest.raises(CheckError, match="policy's loss is not finite at step 0"):
        next(learn(broken, policy, optimiser))
