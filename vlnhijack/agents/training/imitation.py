"""Imitation with the agent's own mistakes in the loop.

Teacher forcing first; then a share of each batch walks a path sampled from the agent itself and
is labelled with the next viewpoint of the shortest path to the goal (DAgger; the student forcing
of Anderson et al. 2018).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
import torch
from torch import Tensor, nn

from vlnhijack import seeds
from vlnhijack.agents.hamt import Hamt
from vlnhijack.agents.observation import ObservationTable
from vlnhijack.agents.reader import Reader
from vlnhijack.agents.rollout import rollout, rows_of
from vlnhijack.agents.training.encoder import warmup_cosine
from vlnhijack.agents.trajectory import (
    Instructions,
    Trajectories,
    history,
    step_logits,
    trajectories,
)
from vlnhijack.agents.vocabulary import UNK
from vlnhijack.errors import CheckError
from vlnhijack.navigation.episode import Episode


@dataclass(frozen=True)
class ImitationSchedule:
    """How a policy is trained.

    steps of `batch` episodes; `forced` share of the steps with teacher forcing only, afterwards
    `sampled` share of each batch walks the agent's own samples; smoothing of the labels over the
    valid actions; peak learning rate and weight decay of AdamW; token_dropout is the chance that a
    word is replaced by [UNK]; longest_sample bounds the moves of a sampled walk.
    """

    steps: int = 3000
    batch: int = 32
    forced: float = 0.4
    sampled: float = 0.5
    smoothing: float = 0.1
    lr: float = 5e-4
    weight_decay: float = 0.01
    token_dropout: float = 0.05
    longest_sample: int = 9


@dataclass
class NextHop:
    """Shortest-path labels: the next viewpoint (row of the table) towards every goal."""

    table: ObservationTable
    _known: dict[int, dict[int, int]] = field(default_factory=dict)

    def __call__(self, here: int, goal: int) -> int:
        """Row of the next viewpoint on the shortest path; −1 (STOP) at the goal itself."""
        if here == goal:
            return -1
        if goal not in self._known:
            self._known[goal] = self._towards(goal)
        return self._known[goal][here]

    def _towards(self, goal: int) -> dict[int, int]:
        names = list(self.table.index)
        scan, viewpoint = names[goal]
        graph = self.table.graphs[scan]
        target = graph.row(viewpoint)
        to_goal = graph.distances[:, target]
        edge = np.linalg.norm(graph.positions[:, None] - graph.positions[None], axis=-1)
        through = np.where(graph.adjacency, edge + to_goal[None], np.inf)
        best = through.argmin(1)
        offset = self.table.index[scan, graph.viewpoints[0]]
        return {offset + row: offset + int(hop) for row, hop in enumerate(best)}


@dataclass(frozen=True, eq=False)
class Lessons:
    """What a policy learns from: episodes in a world whose views have features (M,36,D)."""

    table: ObservationTable
    features: Tensor
    reader: Reader
    episodes: Sequence[Episode]


def train_policy(
    policy: Hamt,
    lessons: Lessons,
    schedule: ImitationSchedule,
    seed: int,
    optimiser: torch.optim.Optimizer,
    *,
    first_step: int = 0,
) -> Iterator[tuple[int, float]]:
    """Train `policy` in place from `first_step` on; yields (steps done, loss) after every step.

    What a step draws depends on seed and step only, so a resumed training repeats it. Raises
    CheckError if the loss is not finite.
    """
    rate = warmup_cosine(schedule.steps)
    next_hop = NextHop(lessons.table)
    for step in range(first_step, schedule.steps):
        rng = seeds.stream(seed, "imitation", step)
        torch.manual_seed(seeds.integer(seed, "imitation", "dropout", step))
        picked = rng.integers(len(lessons.episodes), size=schedule.batch)
        batch = [lessons.episodes[row] for row in picked]
        forced = step < schedule.forced * schedule.steps
        sampled = 0 if forced else int(schedule.batch * schedule.sampled)
        for group in optimiser.param_groups:
            group["lr"] = schedule.lr * rate(step)
        loss = _loss(policy, lessons, batch, sampled, schedule, next_hop, rng)
        if not torch.isfinite(loss):
            raise CheckError(f"the policy's loss is not finite at step {step}")
        optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(policy.parameters(), 1.0)
        optimiser.step()
        yield step + 1, loss.item()
    policy.eval()


def _loss(
    policy: Hamt,
    lessons: Lessons,
    batch: Sequence[Episode],
    sampled: int,
    schedule: ImitationSchedule,
    next_hop: NextHop,
    rng: np.random.Generator,
) -> Tensor:
    """Loss of a batch whose first `sampled` episodes walk the agent's own samples."""
    table = lessons.table
    ids, mask = lessons.reader(batch)
    dropped = torch.from_numpy(rng.random(tuple(ids.shape)) < schedule.token_dropout)
    ids = torch.where(dropped & mask, UNK, ids)
    paths = [rows_of(table, episode) for episode in batch]
    goals = [path[-1] for path in paths]
    headings = [episode.heading for episode in batch]
    if sampled:
        policy.eval()
        with torch.no_grad():
            read = Instructions(policy.encode_text(ids[:sampled], mask[:sampled]), mask[:sampled])
        starts = [path[:1] for path in paths[:sampled]]
        paths[:sampled] = rollout(
            policy,
            table,
            lessons.features,
            read,
            starts,
            headings[:sampled],
            max_steps=schedule.longest_sample,
            sampler=rng,
        )
    policy.train()
    read = Instructions(policy.encode_text(ids, mask), mask)
    walked = trajectories(table, paths, headings)
    rows, steps, targets = _labels(table, walked, goals, next_hop)
    past = history(policy, table, lessons.features, walked)
    logits = step_logits(policy, table, lessons.features, past, read, walked, rows, steps)
    return smoothed_cross_entropy(logits, targets, schedule.smoothing)


def _labels(
    table: ObservationTable, walked: Trajectories, goals: Sequence[int], next_hop: NextHop
) -> tuple[Tensor, Tensor, Tensor]:
    rows, steps, hops = [], [], []
    for row, goal in enumerate(goals):
        for step in range(int(walked.lengths[row])):
            rows.append(row)
            steps.append(step)
            hops.append(next_hop(int(walked.viewpoints[row, step]), goal))
    row_index, step_index = torch.tensor(rows), torch.tensor(steps)
    here = walked.viewpoints[row_index, step_index]
    return row_index, step_index, table.actions(here, torch.tensor(hops))


def smoothed_cross_entropy(logits: Tensor, targets: Tensor, smoothing: float) -> Tensor:
    """Mean cross-entropy with the labels smoothed over the valid actions only.

    logits (K,N), −inf where an action is not valid; targets (K,).
    """
    log_prob = logits.log_softmax(1)
    chosen = log_prob.gather(1, targets[:, None])[:, 0]
    valid = torch.isfinite(logits)
    spread = torch.where(valid, log_prob, 0.0).sum(1) / valid.sum(1)
    return -((1 - smoothing) * chosen + smoothing * spread).mean()
