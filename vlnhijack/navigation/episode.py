"""Episodes, read from the files of Room-to-Room, Room-for-Room and Room-across-Room."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from vlnhijack.artifacts import write_json
from vlnhijack.errors import InputError
from vlnhijack.navigation.annotations import (
    PathRecord,
    R2RRecord,
    RxRRecord,
    r2r_records,
    rxr_records,
)
from vlnhijack.navigation.graph import NavigationGraph

_MANY = 8


@dataclass(frozen=True)
class Episode:
    """One instruction and the path it describes.

    path: viewpoint ids of the scan, start to goal; heading: where the agent looks at the start,
    radians; distance: length of the path in metres; instruction_id: `<path_id>_<number>`, as HAMT
    names it; encoding: token ids of the instruction where the file holds them (HAMT's `_enc`).
    """

    path_id: int
    scan: str
    path: tuple[str, ...]
    heading: float
    instruction: str
    instruction_id: str
    distance: float
    encoding: tuple[int, ...] | None = None


def load_episodes(
    file: Path, graphs: Mapping[str, NavigationGraph], languages: Sequence[str] = ()
) -> list[Episode]:
    """All episodes of a file; see `stream_episodes`."""
    return list(stream_episodes(file, graphs, languages))


def stream_episodes(
    file: Path, graphs: Mapping[str, NavigationGraph], languages: Sequence[str] = ()
) -> Iterator[Episode]:
    """The episodes of an annotation file, one per instruction, in the file's order.

    `.json` holds R2R or R4R records, `.jsonl` RxR guide annotations, of which those in `languages`
    ("en", "hi-IN", …; all without) are taken; both may be gzipped (`.gz`) and hold HAMT's token
    ids. Records are read one at a time. Raises InputError with file, record and field for wrong
    types, a scan without a graph, unknown viewpoints, steps between viewpoints that are not
    adjacent, and repeated ids.
    """
    if ".jsonl" in file.suffixes[-2:]:
        yield from _rxr_episodes(file, graphs, languages)
    else:
        yield from _r2r_episodes(file, graphs)


def by_scan(episodes: Iterable[Episode]) -> dict[str, list[Episode]]:
    """The episodes of each scan, in their order."""
    found: dict[str, list[Episode]] = {}
    for episode in episodes:
        found.setdefault(episode.scan, []).append(episode)
    return found


def save_episodes(file: Path, episodes: Iterable[Episode]) -> None:
    """Write episodes in R2R form."""
    write_json(file, episode_records(episodes))


def episode_records(episodes: Iterable[Episode]) -> list[dict[str, Any]]:
    """Records in R2R form, one of all episodes of a path."""
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
        if episode.encoding is not None:
            record.setdefault("instr_encodings", []).append(list(episode.encoding))
    return list(records.values())


def _r2r_episodes(file: Path, graphs: Mapping[str, NavigationGraph]) -> Iterator[Episode]:
    known: set[tuple[str, int]] = set()
    for where, record in r2r_records(file):
        _check_new(file, f"{where}: path_id", (record.scan, record.path_id), known)
        _check_path(file, where, record, graphs)
        for number, text in enumerate(record.instructions):
            encoding = record.instr_encodings[number] if record.instr_encodings else None
            yield _episode(record, text, number, record.distance, encoding)


def _rxr_episodes(
    file: Path, graphs: Mapping[str, NavigationGraph], languages: Sequence[str]
) -> Iterator[Episode]:
    known: set[int] = set()
    paths: dict[int, tuple[str, list[str]]] = {}
    for where, record in rxr_records(file, languages):
        _check_new(file, f"{where}: instruction_id", record.instruction_id, known)
        _check_path(file, where, record, graphs)
        path = (record.scan, record.path)
        if paths.setdefault(record.path_id, path) != path:
            raise InputError(
                file=file,
                field=f"{where}: path",
                expected=f"one path with path_id {record.path_id}",
                received="another",
            )
        length = graphs[record.scan].length(record.path)
        yield _episode(
            record, record.instruction, record.instruction_id, length, record.instr_encoding
        )


def _episode(
    record: R2RRecord | RxRRecord,
    instruction: str,
    number: int,
    distance: float,
    encoding: list[int] | None,
) -> Episode:
    return Episode(
        record.path_id,
        record.scan,
        tuple(record.path),
        record.heading,
        instruction,
        f"{record.path_id}_{number}",
        distance,
        None if encoding is None else tuple(encoding),
    )


def _check_new(file: Path, field: str, key: Any, known: set[Any]) -> None:
    if key in known:
        raise InputError(file=file, field=field, expected="one record", received="two")
    known.add(key)


def _check_path(
    file: Path, where: str, record: PathRecord, graphs: Mapping[str, NavigationGraph]
) -> None:
    if record.scan not in graphs:
        names = sorted(graphs)
        raise InputError(
            file=file,
            field=f"{where}: scan",
            expected=f"one of {', '.join(names)}" if len(names) <= _MANY else "a scan with a graph",
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
