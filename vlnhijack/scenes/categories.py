"""Matterport3D's category table: what its annotators wrote → the 40 categories of mpcat40."""

from pathlib import Path

from vlnhijack.artifacts import open_text
from vlnhijack.errors import InputError

MPCAT40 = (
    *("void", "wall", "floor", "chair", "door", "table", "picture", "cabinet", "cushion"),
    *("window", "sofa", "bed", "curtain", "chest_of_drawers", "plant", "sink", "stairs"),
    *("ceiling", "toilet", "stool", "towel", "mirror", "tv_monitor", "shower", "column"),
    *("bathtub", "counter", "fireplace", "lighting", "beam", "railing", "shelving", "blinds"),
    *("gym_equipment", "seating", "board_panel", "furniture", "appliances", "clothes"),
    *("objects", "misc", "unlabeled"),
)
STRUCTURE = ("void", "wall", "floor", "stairs", "ceiling", "column", "beam", "unlabeled")

_FROM, _TO = "raw_category", "mpcat40"


def mpcat40_id(category: str) -> int:
    """The index of an mpcat40 category, -1 for another."""
    return MPCAT40.index(category) if category in MPCAT40 else -1


def read_categories(file: Path) -> dict[str, str]:
    """raw category → mpcat40 category, of `category_mapping.tsv`.

    Columns are separated by tabs, or by four spaces in copies without tabs. Raises InputError with
    file, line and field where a column or a value is missing, or a raw category has two meanings.
    """
    with open_text(file) as text:
        header = text.readline().rstrip("\r\n")
        separator = "\t" if "\t" in header else "    "
        names = header.split(separator)
        for name in (_FROM, _TO):
            if name not in names:
                raise InputError(
                    file=file, field="line 1", expected=f"a column {name}", received=header
                )
        table: dict[str, str] = {}
        for number, line in enumerate(text, 2):
            if not line.strip():
                continue
            values = line.rstrip("\r\n").split(separator)
            if len(values) != len(names):
                raise InputError(
                    file=file,
                    field=f"line {number}",
                    expected=f"{len(names)} columns",
                    received=len(values),
                )
            raw, category = values[names.index(_FROM)], values[names.index(_TO)]
            if not raw or not category or table.setdefault(raw, category) != category:
                raise InputError(
                    file=file,
                    field=f"line {number}: {_TO}",
                    expected=f"the one category of {raw!r}",
                    received=category,
                )
    return table
