"""Optimise the texture of one object (paper, section 3.1)."""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from vlnhijack import seeds
from vlnhijack.attack.attacked_views import AttackedViews
from vlnhijack.attack.objective import Objective
from vlnhijack.attack.projected_adam import ProjectedAdam
from vlnhijack.errors import CheckError


@dataclass(frozen=True)
class AttackSchedule:
    """The paper's settings: 300 iterations of 16 episodes, Adam 0.01, a checkpoint every 30."""

    iterations: int = 300
    batch: int = 16
    epsilon: float = 0.3
    lr: float = 0.01
    betas: tuple[float, float] = (0.9, 0.999)
    checkpoint_every: int = 30


class Iteration(NamedTuple):
    """What one iteration measured; `iteration` counts from 1, `stages` are parts of `seconds`."""

    iteration: int
    loss: float
    gradient_norm: float
    largest_change: float
    seconds: float
    stages: dict[str, float]


class Stopwatch:
    """Seconds of the stages of an iteration."""

    def __init__(self) -> None:
        self.stages: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, stage: str) -> None:
        """The time since the last lap was the stage's."""
        now = time.perf_counter()
        self.stages[stage], self._last = now - self._last, now


def optimise(
    texture: ProjectedAdam,
    views: AttackedViews,
    objective: Objective,
    schedule: AttackSchedule,
    seed: int,
    first: int = 0,
) -> Iterator[Iteration]:
    """Take the steps first+1 … iterations on `texture`, yielding what each measured.

    The batch of an iteration depends on seed and iteration only, so a resumed run repeats it.
    Raises CheckError if the loss or the gradient is not finite.
    """
    for iteration in range(first + 1, schedule.iterations + 1):
        watch = Stopwatch()
        episodes = batch_of(seed, iteration, len(objective.first), schedule.batch)
        loss, gradient = loss_and_gradient(texture.value, views, objective, episodes, watch)
        norm = float(gradient.norm())
        if not (np.isfinite(loss) and np.isfinite(norm)):
            raise CheckError(f"iteration {iteration}: the loss or its gradient is not finite")
        texture.step(gradient)
        change = texture.largest_change()
        watch.lap("update")
        seconds = sum(watch.stages.values())
        yield Iteration(iteration, loss, norm, change, seconds, watch.stages)


def loss_and_gradient(
    texture: Tensor, views: AttackedViews, objective: Objective, episodes: Tensor, watch: Stopwatch
) -> tuple[float, Tensor]:
    """Mean loss of the episodes (B,) and its gradient (H,W,3); the watch times four stages."""
    images = views.renderer(texture)
    watch.lap("render")
    features = views.replaced(images)
    watch.lap("vision")
    loss = objective(features, episodes).mean()
    watch.lap("policy")
    (gradient,) = torch.autograd.grad(loss, texture)
    watch.lap("backward")
    return loss.item(), gradient


def batch_of(seed: int, iteration: int, episodes: int, batch: int) -> Tensor:
    """The episodes (B,) of an iteration: every epoch visits each episode once, in a new order."""
    start = (iteration - 1) * batch
    picked = [
        _epoch_order(seed, position // episodes, episodes)[position % episodes]
        for position in range(start, start + batch)
    ]
    return torch.tensor(picked)


def _epoch_order(seed: int, epoch: int, episodes: int) -> list[int]:
    return seeds.stream(seed, "attack", "epoch", epoch).permutation(episodes).tolist()


class Validation(NamedTuple):
    """How good a checkpoint is on the validation episodes."""

    iteration: int
    ndtw: float
    loss: float


def best(checkpoints: list[Validation]) -> Validation:
    """Highest nDTW to the attack trajectory; ties: lower loss, then earlier."""
    return min(checkpoints, key=lambda c: (-c.ndtw, c.loss, c.iteration))
