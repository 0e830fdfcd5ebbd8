"""The attacks of an experiment: every instance with every rendering, each in its own folder."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from vlnhijack.artifacts import read_rows
from vlnhijack.attack.optimise import Validation, best
from vlnhijack.errors import InputError
from vlnhijack.experiments.config import ExperimentConfig, RenderSettings
from vlnhijack.threat import AttackInstance

_ID = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9_.-]*")


@dataclass(frozen=True, eq=False)
class Attack:
    """An instance, the rendering that it is optimised with, and the files of its folder."""

    instance: AttackInstance
    rendering: RenderSettings
    folder: Path

    @property
    def id(self) -> str:
        return self.folder.name

    @property
    def result(self) -> Path:
        return self.folder / "attack.json"

    @property
    def overfitting(self) -> Path:
        return self.folder / "overfitting.json"

    @property
    def log(self) -> Path:
        return self.folder / "log.jsonl"

    @property
    def validations(self) -> Path:
        return self.folder / "validation.jsonl"

    @property
    def house(self) -> Path:
        return self.folder / "house"

    def state(self, iteration: int) -> Path:
        return self.folder / "checkpoints" / f"{iteration:05d}.safetensors"

    def last_iteration(self) -> int:
        """The iteration of the last checkpoint that was validated; 0 without one."""
        return max((row["iteration"] for row in read_rows(self.validations)), default=0)

    def best(self) -> Validation:
        """The checkpoint with the highest nDTW on the validation episodes."""
        rows = read_rows(self.validations)
        return best([Validation(row["iteration"], row["ndtw"], row["loss"]) for row in rows])


def make_attacks(
    config: ExperimentConfig, folder: Path, instances: Sequence[AttackInstance]
) -> list[Attack]:
    """Their ids are those of the instances, with the rendering's name where it is one of a list.

    Raises InputError where they cannot name folders of their own.
    """
    listed = isinstance(config.rendering, list)
    made = [
        (f"{instance.id}-{rendering.name}" if listed else instance.id, instance, rendering)
        for instance in instances
        for rendering in config.renderings
    ]
    times = Counter(name for name, _, _ in made)
    wrong = [name for name in times if times[name] > 1 or not _ID.fullmatch(name)]
    if wrong:
        expected = "distinct ids of letters, digits, _ . and -"
        raise InputError(field="instances", expected=expected, received=wrong)
    return [
        Attack(instance, rendering, folder / "attacks" / name) for name, instance, rendering in made
    ]
