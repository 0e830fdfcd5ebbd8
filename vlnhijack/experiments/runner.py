"""Run an experiment: baseline → attack → evaluation of every instance → summary."""

import json
import platform
from collections.abc import Collection, Sequence
from dataclasses import asdict, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import torch
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from vlnhijack.artifacts import read_json, write_json
from vlnhijack.errors import InputError
from vlnhijack.evaluation.records import save_records
from vlnhijack.evaluation.tables import ATTACKED, arms_of, rows_for_print, summarise
from vlnhijack.experiments.attack_stage import run_attack
from vlnhijack.experiments.attacks import Attack, make_attacks
from vlnhijack.experiments.baseline import baseline
from vlnhijack.experiments.config import ExperimentConfig, StoredInstances
from vlnhijack.experiments.context import Context, load_context
from vlnhijack.experiments.evaluation_stage import evaluate
from vlnhijack.experiments.instances.files import load_instances
from vlnhijack.experiments.instances.houses import draw, pick
from vlnhijack.experiments.overfitting import overfitting
from vlnhijack.experiments.pictures import illustrate
from vlnhijack.experiments.rungs import require_rungs
from vlnhijack.experiments.yaml_config import load_config, save_config
from vlnhijack.scenes.importing.unwrapping import unwrapped
from vlnhijack.threat import AttackInstance

_PACKAGES = ("vlnhijack", "torch", "mitsuba", "drjit", "numpy", "xatlas", "trimesh")


def run(
    config: ExperimentConfig, folder: Path, *, resume: bool, progress: Progress
) -> dict[str, Any]:
    """Run all stages that have no result in `folder` yet; the summary.

    Raises InputError where the folder holds a run that may not be continued, CheckError where the
    baseline gate or an apply check fails.
    """
    make_repeatable(config.threads)
    context = load_context(config, folder, progress)
    require_rungs(config.renderings, context.houses.values())
    instances = make_instances(context)
    context = with_attackable(context, instances)
    attacks = make_attacks(config, folder, instances)
    open_folder(config, folder, resume=resume)
    keep_start(folder, instances, context.inputs)
    seconds = {"baseline": sum(baseline(context, scan) for scan in used_scans(instances))}
    seconds |= {"attack": 0.0, "overfitting": 0.0, "evaluation": 0.0}
    frames, reports = [], {}
    for attack in attacks:
        taken = run_attack(context, attack)
        gap = overfitting(context, attack)
        frame, evaluated = evaluate(context, attack)
        illustrate(context, attack, frame)
        frames.append(frame)
        reports[attack.id] = {"rung": attack.rendering.name, **gap, "seconds": taken}
        seconds["attack"] += taken
        seconds["overfitting"] += gap["seconds"]
        seconds["evaluation"] += evaluated
    records = all_records(attacks, frames)
    save_records(folder / "records.parquet", records)
    summary = {**summarise(records), "attacks": reports, "seconds": seconds}
    write_json(folder / "summary.json", summary)
    return summary


def all_records(attacks: Sequence[Attack], frames: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """Records of all attacks with their rung; the controls of an instance once, without one."""
    parts, seen = [], set()
    for attack, frame in zip(attacks, frames, strict=True):
        attacked = frame["arm"] == ATTACKED
        part = frame.assign(rung=np.where(attacked, attack.rendering.name, ""))
        parts.append(part[attacked] if attack.instance.id in seen else part)
        seen.add(attack.instance.id)
    return pd.concat(parts, ignore_index=True)


def make_repeatable(threads: int) -> None:
    """Equal threads, equal bits: scattered sums (the gradient of indexing) run in a fixed order."""
    torch.set_num_threads(threads)
    torch.use_deterministic_algorithms(True)


def open_folder(config: ExperimentConfig, folder: Path, *, resume: bool) -> None:
    """Start a run folder, or check that the one there is the same run and may be continued."""
    saved = folder / "config.yaml"
    if saved.exists():
        if not resume:
            raise InputError(file=folder, expected="no earlier run (or --resume)", received="one")
        check_same_settings(saved, config)
        return
    if folder.exists() and any(folder.iterdir()):
        raise InputError(file=folder, expected="an empty or new folder", received="other files")
    save_config(saved, config)
    write_json(folder / "environment.json", environment(config))


def check_same_settings(saved: Path, config: ExperimentConfig) -> None:
    """Raises InputError that names the first setting in which `config` differs from a saved one."""
    here, there = (
        each.model_dump(mode="json") for each in (load_config(saved, ExperimentConfig), config)
    )
    for key in here:
        if here[key] != there[key]:
            raise InputError(file=saved, field=key, expected=here[key], received=there[key])


def keep_start(
    folder: Path, instances: Sequence[AttackInstance], inputs: dict[str, dict[str, str]]
) -> None:
    """Write what the run begins with, or check that it is what was written then.

    inputs: see `Context.inputs`. Raises InputError that names what is not the same.
    """
    file = folder / "inputs.json"
    known = _kept(file, inputs)
    changed = {
        path
        for scan, hashes in inputs.items()
        for path, digest in hashes.items()
        if known.get(scan, {}).get(path) != digest
    }
    if changed:
        raise InputError(f"changed since the run began: {', '.join(sorted(changed))}", file=file)
    file, rows = folder / "instances.json", [asdict(instance) for instance in instances]
    if _kept(file, rows) != json.loads(json.dumps(rows)):
        raise InputError("other instances than the run began with", file=file)


def _kept(file: Path, value: Any) -> Any:
    """What the JSON file holds; `value` is written where there is none."""
    if not file.exists():
        write_json(file, value)
    return read_json(file)


def environment(config: ExperimentConfig) -> dict[str, Any]:
    """Versions, machine, threads and seed: what the numbers hang on."""
    return {
        "python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}",
        "packages": {name: _version(name) for name in _PACKAGES},
        "threads": config.threads,
        "seed": config.seed,
    }


def make_instances(context: Context) -> list[AttackInstance]:
    """The experiment's instances: picked by hand, drawn by the seed, or read from a file."""
    wanted, rules, seed = context.config.instances, context.config.rules, context.config.seed
    if isinstance(wanted, list):
        return [pick(context.scan_of(picked.house), picked, rules, seed) for picked in wanted]
    if isinstance(wanted, StoredInstances):
        return stored_instances(Path(wanted.file), context.houses.keys())
    scans = list(context.scans.values())
    return draw(scans, wanted.kind, wanted.count, rules, seed)


def stored_instances(file: Path, houses: Collection[str]) -> list[AttackInstance]:
    """The attacks of the file; InputError where a scan is none of the houses that were loaded."""
    instances = load_instances(file)
    for scan in used_scans(instances):
        if scan not in houses:
            expected = f"the name of a house ({', '.join(houses)})"
            raise InputError(file=file, field="scan", expected=expected, received=scan)
    return instances


def with_attackable(context: Context, instances: Sequence[AttackInstance]) -> Context:
    """The context whose houses have a texture for each attacked object (see `unwrapping`)."""
    houses = {
        name: unwrapped(house, [each.object_id for each in instances if each.scan == name])
        for name, house in context.houses.items()
    }
    return context if houses == context.houses else replace(context, houses=houses)


def used_scans(instances: Sequence[AttackInstance]) -> list[str]:
    return sorted({instance.scan for instance in instances})


def print_summary(console: Console, config: ExperimentConfig, folder: Path) -> None:
    """The table of condition Test, percent with 95 % intervals."""
    summary = read_json(folder / "summary.json")
    table = Table(title=f"{config.name}: condition Test, % [95 % interval]", caption=config.note)
    for column in ("attack", "measure", "n", *arms_of(summary)):
        table.add_column(column, justify="left" if column in ("attack", "measure") else "right")
    for row in rows_for_print(summary):
        table.add_row(*row)
    console.print(table)
    console.print(_attacks_table(summary["attacks"]))
    seconds = {stage: round(taken) for stage, taken in summary["seconds"].items()}
    console.print(f"seconds: {json.dumps(seconds)}; everything is in {folder}")


def _attacks_table(attacks: dict[str, dict[str, Any]]) -> Table:
    table = Table(title="loss of the training episodes at the attack's own camera rays and others")
    for column in ("attack", "seconds", "own rays", "other rays", "gap, %"):
        table.add_column(column, justify="left" if column == "attack" else "right", overflow="fold")
    for name, row in attacks.items():
        others = f"{row['loss_other_rays']:.3f} ± {row['deviation']:.3f}"
        own = "–" if row["loss_own_rays"] is None else f"{row['loss_own_rays']:.3f}"
        gap = "–" if row["gap"] is None else f"{100 * row['gap']:.1f}"
        table.add_row(name, f"{row['seconds']:.0f}", own, others, gap)
    return table


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
