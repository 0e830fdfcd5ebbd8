"""Attack instances on disk, and what they amount to."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pandas as pd
from pydantic import BaseModel, TypeAdapter

from vlnhijack.artifacts import read_json, validated, write_json
from vlnhijack.errors import InputError
from vlnhijack.evaluation.records import save_records
from vlnhijack.experiments.config import DatasetInstances
from vlnhijack.threat import AttackInstance


class _File(BaseModel):
    settings: dict[str, Any]
    summary: dict[str, Any]
    attacks: list[AttackInstance]


_FILE = TypeAdapter(_File)


def summarise(attacks: Sequence[AttackInstance]) -> dict[str, Any]:
    """Counts in the paper's sense: an instance is a val_seen instruction that is attacked.

    Train and validation episodes are summed over attacks, of which the instructions of a path
    share one unless each has its own.
    """
    by_category: Counter[str] = Counter()
    for attack in attacks:
        by_category[attack.category] += len(attack.test)
    return {
        "instances": by_category.total(),
        "paths": len({(a.scan, episode.path_id) for a in attacks for episode in a.test}),
        "objects": len({(a.scan, a.object_id) for a in attacks}),
        "environments": len({a.scan for a in attacks}),
        "train_episodes": sum(len(a.train) for a in attacks),
        "validation_episodes": sum(len(a.validation) for a in attacks),
        "by_category": dict(by_category.most_common()),
    }


def save_instances(
    file: Path, attacks: Sequence[AttackInstance], settings: DatasetInstances
) -> None:
    """Write a row per instance to `file` (Parquet), and whole attacks to a .json beside it.

    The JSON holds "settings", "summary" and "attacks"; `load_instances` and experiments read it.
    Raises InputError where the name does not end in .parquet.
    """
    if file.suffix != ".parquet":
        raise InputError(file=file, expected="a name that ends in .parquet", received=file.name)
    rows = [_row(attack, number) for attack in attacks for number in range(len(attack.test))]
    save_records(file, pd.DataFrame(rows))
    whole = {
        "settings": settings.model_dump(mode="json"),
        "summary": summarise(attacks),
        "attacks": [asdict(attack) for attack in attacks],
    }
    write_json(file.with_suffix(".json"), whole)


def load_instances(file: Path) -> list[AttackInstance]:
    """The attacks of a .json that `save_instances` wrote; InputError where it is none."""
    return validated(_FILE, read_json(file), file).attacks


def _row(attack: AttackInstance, number: int) -> dict[str, Any]:
    episode = attack.test[number]
    return {
        "attack": attack.id,
        "kind": attack.kind,
        "scan": attack.scan,
        "object": attack.object_id,
        "category": attack.category,
        "viewpoint": attack.viewpoint,
        "coverage": attack.coverage,
        "trajectory": list(attack.trajectory),
        "path_id": episode.path_id,
        "instruction_id": episode.instruction_id,
        "instruction": episode.instruction,
        "path": list(episode.path),
        "train": [e.instruction_id for e in attack.train],
        "validation": [e.instruction_id for e in attack.validation],
    }
