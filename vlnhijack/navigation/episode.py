"""Episodes in the form of the Room-to-Room data set."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from vlnhijack.artifacts import read_json, write_json
from vlnhijack.errors import InputError
from vlnhijack.navigation.graph import NavigationGraph


@dataclass(frozen=True)
class Episode:
    """One instruction and the path it describes.

    path: viewpoint ids of the scan, start to goal; heading: where the agent looks at the start,
    radians; distance: length of the path in metres; instruction_id: `<path_id>_<number>`, as HAMT
    names it.
    """

    path_id: int
    scan: str
    path: tuple[str, ...]
    heading: float
    instruction: str
    instruction_id: str
    distance: float


class _Record(BaseModel):
    model_config = ConfigDict(strict=True)
    path_id: int
    scan: str
    path: Annotated[list[str], Field(min_length=1)]
    heading: Annotated[float, Field(allow_inf_nan=False)]
    distance: Annotated[float, Field(allow_inf_nan=False, ge=0)]
    instructions: Annotated[list[Annotated[str, Field(pattern=r"\S")]], Field(min_length=1)]


def load_episodes(file: Path, graphs: Mapping[str, NavigationGraph]) -> list[Episode]:
    """The episodes of an R2R JSON file, one per instruction, in the file's order.

    Raises InputError with file, record and field for wrong types, a scan without a graph, unknown
    viewpoints, steps between viewpoints that are not adjacent, and repeated path ids.
    """
    episodes: list[Episode] = []
    known: set[tuple[str, int]] = set()
    for number, record in enumerate(_records(file)):
        where = f"record {number} (path_id {record.path_id})"
        if (record.scan, record.path_id) in known:
            raise InputError(
                file=file, field=f"{where}: path_id", expected="one record", received="two"
            )
        known.add((record.scan, record.path_id))
        _check_path(file, where, record, graphs)
        episodes += _episodes_of(record)
    return episodes


def save_episodes(file: Path, episodes: Iterable[Episode]) -> None:
    """Write episodes in R2R form, those of one path as one record."""
    records: dict[tuple[str, int], dict[str, Any]] = {}
    for episode in episodes:
        record = records.setdefault(
            (episode.scan, episode.path_id),
            {
                "distance": round(episode.distance, 2),
                "scan": episode.scan,
                "path_id": episode.path_id,
                "path": list(episode.path),
                "heading": episode.heading,
                "instructions": [],
            },
        )
        record["instructions"].append(episode.instruction)
    write_json(file, list(records.values()))


def _records(file: Path) -> list[_Record]:
    try:
        return TypeAdapter(list[_Record]).validate_python(read_json(file))
    except ValidationError as error:
        first = error.errors()[0]
        where = [f"record {part}" if isinstance(part, int) else part for part in first["loc"][:1]]
        field = ": ".join([*where, ".".join(map(str, first["loc"][1:]))]).rstrip(": ")
        raise InputError(
            file=file, field=field or None, expected=first["msg"], received=first["input"]
        ) from None


def _check_path(
    file: Path, where: str, record: _Record, graphs: Mapping[str, NavigationGraph]
) -> None:
    if record.scan not in graphs:
        raise InputError(
            file=file,
            field=f"{where}: scan",
            expected=f"one of {', '.join(sorted(graphs))}",
            received=record.scan,
        )
    graph = graphs[record.scan]
    for step, viewpoint in enumerate(record.path):
        if viewpoint not in graph.index:
            raise InputError(
                file=file,
                field=f"{where}: path[{step}]",
                expected=f"a viewpoint of {record.scan}",
                received=viewpoint,
            )
    for step, (here, there) in enumerate(pairwise(record.path)):
        if not graph.adjacency[graph.index[here], graph.index[there]]:
            raise InputError(
                file=file,
                field=f"{where}: path[{step + 1}]",
                expected=f"a neighbour of {here}",
                received=there,
            )


def _episodes_of(record: _Record) -> list[Episode]:
    return [
        Episode(
            record.path_id,
            record.scan,
            tuple(record.path),
            record.heading,
            instruction,
            f"{record.path_id}_{number}",
            record.distance,
        )
        for number, instruction in enumerate(record.instructions)
    ]
