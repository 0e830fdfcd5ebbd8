"""Let an agent act until it stops."""

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from vlnhijack.agents.observation import ObservationTable
from vlnhijack.agents.policy import Policy
from vlnhijack.agents.trajectory import (
    Instructions,
    Trajectories,
    history,
    step_logits,
    trajectories,
)
from vlnhijack.navigation.episode import Episode

MAX_STEPS = 15


def rows_of(table: ObservationTable, episode: Episode) -> list[int]:
    """The episode's path as rows of the table."""
    return [table.index[episode.scan, viewpoint] for viewpoint in episode.path]


@torch.no_grad()
def rollout(
    policy: Policy,
    table: ObservationTable,
    features: Tensor,
    instructions: Instructions,
    guides: Sequence[Sequence[int]],
    start_headings: Sequence[float],
    *,
    max_steps: int = MAX_STEPS,
    sampler: np.random.Generator | None = None,
) -> list[list[int]]:
    """Walk B episodes and give their paths (rows of the table), guide included.

    Each guide (≥ 1 viewpoint) is walked first; from its last viewpoint the agent acts, by argmax
    or, with a sampler, by a draw from its distribution, until STOP or `max_steps` own moves.
    """
    paths = [list(guide) for guide in guides]
    active = list(range(len(paths)))
    for _ in range(max_steps):
        walked = trajectories(
            table, [paths[e] for e in active], [start_headings[e] for e in active]
        )
        actions = _choose(
            policy, table, features, instructions.rows(torch.tensor(active)), walked, sampler
        )
        here = walked.viewpoints[torch.arange(len(active)), walked.lengths - 1]
        targets = table.targets[here, actions].tolist()
        for episode, target in zip(active, targets, strict=True):
            if target >= 0:
                paths[episode].append(target)
        active = [e for e, target in zip(active, targets, strict=True) if target >= 0]
        if not active:
            break
    return paths


def _choose(
    policy: Policy,
    table: ObservationTable,
    features: Tensor,
    instructions: Instructions,
    walked: Trajectories,
    sampler: np.random.Generator | None,
) -> Tensor:
    logits = step_logits(
        policy,
        table,
        features,
        history(policy, table, features, walked),
        instructions,
        walked,
        torch.arange(len(walked.lengths)),
        walked.lengths - 1,
    )
    if sampler is None:
        return logits.argmax(1)
    gumbel = torch.from_numpy(sampler.gumbel(size=tuple(logits.shape))).to(logits.dtype)
    return (logits + gumbel).argmax(1)
