"""One row per evaluated episode, kept as Parquet."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import pandas as pd

from vlnhijack.artifacts import atomic_path
from vlnhijack.errors import InputError


@dataclass(frozen=True)
class Record:
    """What the agent did in one arm.

    guide: forced viewpoints up to v_ATK; path: viewpoints walked from v_ATK on, v_ATK first;
    stopped: STOP at once; attack_*: against the attack trajectory; original_*: against the rest of
    the instruction's own path. Rates and nDTW in 0–1.
    """

    instance: str
    kind: str
    scan: str
    object: str
    category: str
    viewpoint: str
    arm: str
    condition: str
    path_id: int
    instruction_id: str
    guide: list[str]
    path: list[str]
    stopped: bool
    attack_success: float
    attack_oracle_success: float
    attack_ndtw: float
    original_success: float
    original_ndtw: float


def to_frame(records: Sequence[Record]) -> pd.DataFrame:
    return pd.DataFrame([asdict(record) for record in records])


def save_records(path: Path, records: pd.DataFrame) -> None:
    with atomic_path(path) as temporary:
        records.to_parquet(temporary, index=False)


def load_records(path: Path) -> pd.DataFrame:
    """Raises InputError where the file is missing or not Parquet."""
    try:
        return pd.read_parquet(path)
    except FileNotFoundError:
        raise InputError(file=path, expected="a Parquet file", received="no such file") from None
    except (OSError, ValueError) as error:
        raise InputError(f"not a Parquet file ({error})", file=path) from None
