"""`vlnhijack bench attack`: what an iteration of the paper's size costs."""

import json
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from vlnhijack.cli.console import console, progress_bars

if TYPE_CHECKING:
    from vlnhijack.experiments.bench.attack import AttackCost


class PresetName(StrEnum):
    r2r = "r2r"
    rxr = "rxr"


def attack(
    preset: Annotated[PresetName, typer.Option(help="Sizes of agent and instructions.")] = (
        PresetName.r2r
    ),
    house: Annotated[str, typer.Option(help="A baked house: its folder, or its name.")] = "alder",
    seed: Annotated[int, typer.Option(help="Draws weights, instructions and features.")] = 0,
    threads: Annotated[int, typer.Option(min=1, help="Threads of PyTorch.")] = 2,
    out: Annotated[Path, typer.Option(help="Folder of attack.json.")] = Path("bench"),
    as_json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
) -> None:
    """Seconds of an attack's iteration by stage, its memory, and what bfloat16 changes."""
    from vlnhijack.artifacts import write_json
    from vlnhijack.experiments.bench.attack import bench_attack
    from vlnhijack.experiments.bench.costs import machine
    from vlnhijack.experiments.bench.paper_scale import PRESETS, paper_scale
    from vlnhijack.experiments.runner import make_repeatable
    from vlnhijack.settings import house_folder

    make_repeatable(threads)
    scale = paper_scale(PRESETS[preset.value], house_folder(house), seed)
    with progress_bars() as progress:
        cost = bench_attack(scale, progress)
    settings = {"preset": preset.value, "house": house, "seed": seed, "threads": threads}
    rows = [vars(row) for row in cost.rows]
    record = {**cost.summary(), "rows": rows, "settings": settings, "machine": machine()}
    write_json(out / "attack.json", record)
    if as_json:
        print(json.dumps(cost.summary()))
    else:
        _print(cost, settings)
        console.print(f"written: {out / 'attack.json'}")


def _print(cost: "AttackCost", settings: dict[str, Any]) -> None:
    from rich.table import Table

    from vlnhijack.experiments.bench.attack import NAIVE_EPISODES, PAPER_ITERATIONS

    table = Table(title=", ".join(f"{name} {value}" for name, value in settings.items()))
    rows = cost.rows
    table.add_column("vision\npolicy")
    for row in rows:
        table.add_column(f"{row.vision}\n{row.policy}", justify="right")
    table.add_row("seconds per iteration", *(f"{row.seconds:.2f}" for row in rows))
    for stage in rows[0].stages:
        table.add_row(f"  {stage}", *(f"{row.stages[stage]:.2f}" for row in rows))
    faster = (cost.naive_seconds / row.seconds for row in rows)
    table.add_row("× faster than naive", *(f"{ratio:.1f}" for ratio in faster))
    table.add_row("peak memory, MB", *(f"{row.peak_memory_mb:.0f}" for row in rows))
    table.add_row("loss error", *(f"{row.loss_error:.1e}" for row in rows))
    table.add_row("gradient cosine", *(f"{row.grad_cosine:.5f}" for row in rows))
    console.print(table)
    minutes = PAPER_ITERATIONS * cost.rows[-1].seconds / 60
    console.print(
        f"The default precision is that of the last column: {PAPER_ITERATIONS} iterations take "
        f"{minutes:.0f} minutes. The naive way, float32, every episode with its own views and one "
        f"step after the other, takes {cost.naive_seconds:.0f} s per iteration "
        f"(from {NAIVE_EPISODES} episodes)."
    )
