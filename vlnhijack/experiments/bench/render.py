"""What each renderer costs on one view of a house, and how wrong it is (design, 5)."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import product

import numpy as np
from rich.progress import Progress

from vlnhijack import seeds
from vlnhijack.experiments.bench.costs import Costs, measure
from vlnhijack.experiments.bench.reference import SPP_AND_BATCHES, Errors, converged
from vlnhijack.experiments.bench.subject import RUNGS, Subject

SPPS = {"baked": (1, 4, 16, 64), "lit": (4, 16)}
SIZES = {"baked": (640, 480), "lit": (128, 96)}
REPETITIONS = 5
_PERFECT = 1e-7


@dataclass(frozen=True)
class Row:
    """One rung at one number of samples per pixel.

    Costs are medians over REPETITIONS (see `Costs`); errors against the reference are means (see
    `Errors`), PSNR (dB) that of the mean RMSE; `_se` are standard errors of the means.
    """

    rung: str
    spp: int
    forward_s: float
    forward_backward_s: float
    build_s: float
    memory_mb: float
    rmse: float
    rmse_se: float
    psnr: float
    grad_cosine: float
    grad_cosine_se: float
    grad_norm_ratio: float
    grad_norm_ratio_se: float
    grad_bias: float
    grad_bias_se: float


def bench_render(
    subject: Subject, spps: Sequence[int], progress: Progress
) -> tuple[list[Row], dict[str, float]]:
    """One row per rung and number of samples, measured in turn after a warm-up.

    Every repetition draws other camera rays, equal for all rungs. Also the expected errors of the
    reference (see `Reference.own_errors`). Raises InputError where a number of samples is no
    square.
    """
    kind = subject.house.kind
    cases = list(product(RUNGS[kind], spps))
    task = progress.add_task(
        "renderers", total=len(cases) * (1 + REPETITIONS) + SPP_AND_BATCHES[kind][1]
    )
    for rung, spp in cases:
        measure(subject, rung, spp, seeds.integer(0, "bench warm-up"))
        progress.advance(task)
    reference = converged(subject, lambda: progress.advance(task))
    found: dict[tuple[str, int], list[tuple[Costs, Errors]]] = {case: [] for case in cases}
    for repetition, (rung, spp) in product(range(REPETITIONS), cases):
        seed = seeds.integer(0, "bench", repetition)
        costs, image, gradient = measure(subject, rung, spp, seed)
        found[rung, spp].append((costs, reference.errors(image, gradient)))
        progress.advance(task)
    return [_row(*case, results) for case, results in found.items()], reference.own_errors()


def _row(rung: str, spp: int, results: Sequence[tuple[Costs, Errors]]) -> Row:
    costs, errors = ([asdict(part) for part in parts] for parts in zip(*results, strict=True))
    figures = {name: float(np.median([cost[name] for cost in costs])) for name in costs[0]}
    for name in errors[0]:
        values = [error[name] for error in errors]
        figures[name] = float(np.mean(values))
        figures[f"{name}_se"] = float(np.std(values, ddof=1) / len(values) ** 0.5)
    psnr = -20 * float(np.log10(max(figures["rmse"], _PERFECT)))
    return Row(rung=rung, spp=spp, psnr=psnr, **figures)
