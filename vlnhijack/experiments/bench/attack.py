"""What an iteration of a paper-scale attack costs, and what bfloat16 changes."""

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

import torch
from rich.progress import Progress
from torch import Tensor

from vlnhijack.agents.precision import Precision, default_precision, set_precision
from vlnhijack.agents.trajectory import Trajectories, history, step_logits
from vlnhijack.attack.attacked_views import AttackedViews
from vlnhijack.attack.objective import Objective
from vlnhijack.attack.optimise import AttackSchedule, Stopwatch, loss_and_gradient, optimise
from vlnhijack.errors import CheckError
from vlnhijack.experiments.bench.paper_scale import PaperScale, Preset
from vlnhijack.rendering.memory import peak, restart_peak

ITERATIONS = 3
NAIVE_EPISODES = 2
PAPER_ITERATIONS = 300


@dataclass(frozen=True)
class Row:
    """Medians of an iteration, in seconds, at one precision of each stage.

    peak_memory_mb: largest resident memory of the process (10⁶ bytes). Against float32: difference
    of the loss relative to it, and cosine of the gradient of the same batch.
    """

    vision: Precision
    policy: Precision
    seconds: float
    stages: dict[str, float]
    peak_memory_mb: float
    loss_error: float
    grad_cosine: float


@dataclass(frozen=True)
class AttackCost:
    """The naive way's seconds, and rows of which the last has the default precision."""

    naive_seconds: float
    rows: Sequence[Row]

    def summary(self) -> dict[str, Any]:
        """The figures at the default precision."""
        row = self.rows[-1]
        return {
            "seconds_per_iteration": row.seconds,
            "naive_seconds_per_iteration": self.naive_seconds,
            "stages": row.stages,
            "peak_memory_mb": row.peak_memory_mb,
            "grad_cosine": row.grad_cosine,
            "loss_error": row.loss_error,
        }


def precisions(preset: Preset) -> list[tuple[Precision, Precision]]:
    """Precisions of vision and policy that are measured: float32 first, the default last."""
    vision = default_precision(preset.vision.feature_size)
    policy = default_precision(preset.policy.hidden_size)
    either: list[tuple[Precision, Precision]] = [(vision, "float32"), ("float32", policy)]
    return list(dict.fromkeys([("float32", "float32"), *either, (vision, policy)]))


def bench_attack(scale: PaperScale, progress: Progress) -> AttackCost:
    """Measure the naive way in float32, then iterations at each of `precisions`.

    Raises CheckError where the naive way's gradient is another than that of the attack.
    """
    pairs = precisions(scale.preset)
    task = progress.add_task("precisions", total=1 + len(pairs))
    naive_seconds = _naive_seconds(scale)
    progress.advance(task)
    rows, exact = [], None
    for vision, policy in pairs:
        row, exact = _measure(scale, vision, policy, exact)
        rows.append(row)
        progress.advance(task)
    return AttackCost(naive_seconds, rows)


def one_by_one(
    texture: Tensor, views: AttackedViews, objective: Objective, episode: int
) -> tuple[float, Tensor]:
    """Loss of an episode and its gradient (H,W,3) the naive way: own views, step after step."""
    agent, table, alone = objective.agent, objective.table, torch.tensor([episode])
    walked = Trajectories(*(part[alone] for part in objective.walked))
    features = views.features(texture)
    past = history(agent.policy, table, features, walked)
    read = objective.instructions.rows(alone)
    loss = features.new_zeros(())
    for step in range(int(objective.first[episode]), int(walked.lengths)):
        here = torch.tensor([0]), torch.tensor([step])
        logits = step_logits(agent.policy, table, features, past, read, walked, *here)
        loss = loss - logits.log_softmax(1)[0, walked.actions(table)[0, step]]
    (gradient,) = torch.autograd.grad(loss, texture)
    return loss.item(), gradient


def _naive_seconds(scale: PaperScale) -> float:
    """Seconds of a batch, from some of its episodes, whose gradient the attack's has to equal."""
    views, objective = scale.problem(scale.agent())
    texture, some = scale.texture().value, torch.arange(NAIVE_EPISODES)
    watch = Stopwatch()
    gradients = [one_by_one(texture, views, objective, episode)[1] for episode in some.tolist()]
    watch.lap("naive")
    _, together = loss_and_gradient(texture, views, objective, some, Stopwatch())
    if _cosine(torch.stack(gradients).sum(0), together) < 0.9999:
        raise CheckError("the attack's gradient is not that of its episodes one by one")
    return watch.stages["naive"] / NAIVE_EPISODES * len(objective.first)


def _measure(
    scale: PaperScale, vision: Precision, policy: Precision, exact: tuple[float, Tensor] | None
) -> tuple[Row, tuple[float, Tensor]]:
    """A row, and loss and gradient of float32: `exact` or, where there are none, this row's."""
    agent = scale.agent()
    set_precision(agent.encoder, vision)
    set_precision(agent.policy, policy)
    views, objective = scale.problem(agent)
    batch = torch.arange(len(objective.first))
    found = loss_and_gradient(scale.texture().value, views, objective, batch, Stopwatch())
    loss, gradient = exact = exact or found
    restart_peak()
    schedule = AttackSchedule(ITERATIONS, batch=len(batch))
    iterations = list(optimise(scale.texture(), views, objective, schedule, scale.seed))
    row = Row(
        vision=vision,
        policy=policy,
        seconds=median(each.seconds for each in iterations),
        stages={
            name: median(each.stages[name] for each in iterations) for name in iterations[0].stages
        },
        peak_memory_mb=peak(),
        loss_error=abs(found[0] - loss) / loss,
        grad_cosine=_cosine(found[1], gradient),
    )
    return row, exact


def _cosine(first: Tensor, second: Tensor) -> float:
    return float(torch.cosine_similarity(first.ravel().double(), second.ravel().double(), 0))
