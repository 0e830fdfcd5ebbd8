"""The `.house` file: regions, categories and objects of a scan, as ASCII lines.

    H name label #images #panoramas #vertices #surfaces #segments #objects #categories #regions …
    R region level 0 0 label  px py pz  xlo ylo zlo xhi yhi zhi  height  0 0 0 0
    C category label_id label mpcat40_id mpcat40  0 0 0 0 0
    O object region category  px py pz  a0x a0y a0z  a1x a1y a1z  r0 r1 r2  0 0 0 0 0 0 0 0
    E segment object id area  px py pz  xlo ylo zlo xhi yhi zhi  0 0 0 0 0

An index counts from 0, -1 stands for none; `#` in a label is a space. Segments are only counted;
the lines of levels, panoramas, images, portals and outlines (L, P, I, S, V) are passed over.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vlnhijack.artifacts import open_text
from vlnhijack.errors import InputError

VERSION = "ASCII 1.1"
_COUNTS = {"E": 7, "O": 8, "C": 9, "R": 10}  # words of the H line
_WORDS = {"H": 13, "R": 15, "C": 6, "O": 16, "E": 4}  # that are read


@dataclass(frozen=True)
class Region:
    """A room-like part: the letter of its kind, and (xlo, ylo, zlo, xhi, yhi, zhi) in metres."""

    code: str
    bounds: tuple[float, ...]


@dataclass(frozen=True)
class Category:
    """What an annotator called a thing, and its mpcat40 category."""

    label: str
    mpcat40: str


@dataclass(frozen=True)
class ScanObject:
    """An object instance: indices of region and category (-1 for none), centre in metres."""

    region: int
    category: int
    centre: tuple[float, ...]


@dataclass(frozen=True)
class HouseFile:
    """What a `.house` file says that a house needs."""

    name: str
    regions: tuple[Region, ...]
    categories: tuple[Category, ...]
    objects: tuple[ScanObject, ...]

    def category(self, index: int) -> Category:
        """The category of an object."""
        number = self.objects[index].category
        return self.categories[number] if number >= 0 else Category("unknown", "unlabeled")


def read_house_file(file: Path) -> HouseFile:
    """Read a `.house` file; InputError names the line and field that is wrong or missing."""
    rows = _read_rows(file)
    categories = [Category(_spaced(r.words[3]), _spaced(r.words[5])) for r in rows["C"]]
    regions = [Region(r.words[5], r.numbers("bounds", 9, 15)) for r in rows["R"]]
    objects = [
        ScanObject(
            r.index("region", 2, len(regions)),
            r.index("category", 3, len(categories)),
            r.numbers("position", 4, 7),
        )
        for r in rows["O"]
    ]
    for key in "CRO":
        for number, row in enumerate(rows[key]):
            row.expect("index", 1, number)
    name = rows["H"][0].words[1]
    return HouseFile(name, tuple(regions), tuple(categories), tuple(objects))


@dataclass(frozen=True)
class _Row:
    """A line's number and words."""

    file: Path
    number: int
    words: Sequence[str]

    def integer(self, field: str, at: int) -> int:
        try:
            return int(self.words[at])
        except ValueError:
            raise self.error(field, "an integer", self.words[at]) from None

    def index(self, field: str, at: int, end: int) -> int:
        """An index below `end`, or -1."""
        value = self.integer(field, at)
        if not -1 <= value < end:
            raise self.error(field, f"an index below {end}, or -1", value)
        return value

    def numbers(self, field: str, start: int, end: int) -> tuple[float, ...]:
        """Finite numbers."""
        try:
            values = tuple(float(word) for word in self.words[start:end])
        except ValueError:
            values = (np.nan,)
        if not np.isfinite(values).all():
            raise self.error(field, "finite numbers", " ".join(self.words[start:end]))
        return values

    def expect(self, field: str, at: int, value: int) -> None:
        received = self.integer(field, at)
        if received != value:
            raise self.error(field, value, received)

    def error(self, field: str, expected: object, received: object) -> InputError:
        where = f"line {self.number}: {self.words[0]}: {field}"
        return InputError(file=self.file, field=where, expected=expected, received=received)


def _read_rows(file: Path) -> dict[str, list[_Row]]:
    """The rows of each kind that is read, as many as the H line says."""
    rows: dict[str, list[_Row]] = {key: [] for key in _WORDS}
    with open_text(file) as text:
        version = text.readline().strip()
        if version != VERSION:
            raise InputError(file=file, field="line 1", expected=VERSION, received=version)
        for number, line in enumerate(text, 2):
            words = line.split()
            if not words or words[0] not in rows:
                continue
            row = _Row(file, number, words)
            if len(words) < _WORDS[words[0]]:
                raise row.error("words", f"≥ {_WORDS[words[0]]}", len(words))
            rows[words[0]].append(row)
    if len(rows["H"]) != 1:
        raise InputError(file=file, field="H", expected="one line", received=len(rows["H"]))
    for key, at in _COUNTS.items():
        rows["H"][0].expect(f"number of {key} lines", at, len(rows[key]))
    return rows


def _spaced(word: str) -> str:
    return word.replace("#", " ")
