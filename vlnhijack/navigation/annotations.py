"""The records of annotation files: Room-to-Room, Room-for-Room and Room-across-Room.

What a record holds beyond the fields below (timed words of Room-across-Room, whose pose traces are
files of their own; shortest paths of Room-for-Room; …) is ignored.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from vlnhijack.artifacts import stream_json_lines, stream_json_list, validated
from vlnhijack.errors import InputError

Instruction = Annotated[str, Field(pattern=r"\S")]
Tokens = Annotated[list[Annotated[int, Field(ge=0)]], Field(min_length=1)]


class PathRecord(BaseModel):
    """What every record says: where the path lies, and where the agent looks at its start."""

    model_config = ConfigDict(strict=True)
    path_id: int
    scan: str
    path: Annotated[list[str], Field(min_length=1)]
    heading: Annotated[float, Field(allow_inf_nan=False)]


class R2RRecord(PathRecord):
    """A path of Room-to-Room or Room-for-Room; HAMT's `_enc` files add instr_encodings."""

    distance: Annotated[float, Field(allow_inf_nan=False, ge=0)]
    instructions: Annotated[list[Instruction], Field(min_length=1)]
    instr_encodings: list[Tokens] | None = None


class RxRRecord(PathRecord):
    """A guide annotation of Room-across-Room; HAMT's `_enc_xlmr` files add instr_encoding."""

    instruction_id: int
    language: str
    instruction: Instruction
    instr_encoding: Tokens | None = None


_R2R = TypeAdapter(R2RRecord)
_RXR = TypeAdapter(RxRRecord)


def r2r_records(file: Path) -> Iterator[tuple[str, R2RRecord]]:
    """The records of a .json(.gz) file, each with its name for error messages."""
    for number, value in enumerate(stream_json_list(file)):
        record = validated(_R2R, value, file, f"record {number}")
        where = f"record {number} (path_id {record.path_id})"
        encodings = record.instr_encodings
        if encodings is not None and len(encodings) != len(record.instructions):
            raise InputError(
                file=file,
                field=f"{where}: instr_encodings",
                expected=f"{len(record.instructions)} lists, one per instruction",
                received=len(encodings),
            )
        yield where, record


def rxr_records(file: Path, languages: Sequence[str]) -> Iterator[tuple[str, RxRRecord]]:
    """The same for a .jsonl(.gz) file, in the given languages; all of them where none is given.

    "en" selects en-IN and en-US, "en-US" that one. InputError where a file has none of them.
    """
    others: set[str] = set()
    found = False
    for number, value in enumerate(stream_json_lines(file)):
        record = validated(_RXR, value, file, f"record {number}")
        if languages and not any(_speaks(record.language, tag) for tag in languages):
            others.add(record.language)
            continue
        found = True
        yield f"record {number} (path_id {record.path_id})", record
    if languages and not found:
        raise InputError(
            file=file,
            field="language",
            expected=f"records in {' or '.join(languages)}",
            received=", ".join(sorted(others)) or "no records",
        )


def _speaks(language: str, tag: str) -> bool:
    return language == tag or language.startswith(f"{tag}-")
