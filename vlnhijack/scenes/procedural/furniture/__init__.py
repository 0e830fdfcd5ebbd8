"""Furniture modelled from simple solids, with many random variations.

`make_piece(category, rng)` makes a piece, `place` puts it into a house as a surface. Names follow
Matterport3D's mpcat40 where it has one.
"""

from collections.abc import Callable

import numpy as np

from vlnhijack.errors import InputError
from vlnhijack.scenes.procedural.furniture import (
    bathroom,
    bedroom,
    decor,
    electronics,
    kitchen,
    plants,
    seating,
    storage,
    tables,
)
from vlnhijack.scenes.procedural.furniture.piece import Part, Piece, assemble, place

_BUILDERS: dict[str, Callable[[np.random.Generator, bool], Piece]] = {
    "chair": seating.chair,
    "cabinet": storage.cabinet,
    "table": tables.table,
    "plant": plants.plant,
    "sofa": seating.sofa,
    "tv_monitor": electronics.tv_monitor,
    "bed": bedroom.bed,
    "lamp": electronics.lamp,
    "table_lamp": electronics.table_lamp,
    "shelf": storage.shelf,
    "rug": decor.rug,
    "picture": decor.picture,
    "mirror": decor.mirror,
    "curtain": decor.curtain,
    "fireplace": decor.fireplace,
    "desk": tables.desk,
    "nightstand": storage.nightstand,
    "coat_stand": storage.coat_stand,
    "piano": electronics.piano,
    "stool": seating.stool,
    "bench": seating.bench,
    "fridge": kitchen.fridge,
    "stove": kitchen.stove,
    "counter": kitchen.counter,
    "sink": kitchen.sink,
    "washbasin": bathroom.washbasin,
    "toilet": bathroom.toilet,
    "bathtub": bathroom.bathtub,
    "washing_machine": bathroom.washing_machine,
}
CATEGORIES: tuple[str, ...] = tuple(_BUILDERS)
ATTACKABLE: tuple[str, ...] = CATEGORIES[:6]
"""The categories that the paper attacks; these have large variants."""

__all__ = ["ATTACKABLE", "CATEGORIES", "Part", "Piece", "assemble", "make_piece", "place"]


def make_piece(category: str, rng: np.random.Generator, large: bool = False) -> Piece:
    """A random piece of furniture: base on z = 0, centred on x = y = 0, front towards +y.

    `large` asks for one that fills much of a view from 1 m. Raises InputError for an unknown
    category.
    """
    if category not in _BUILDERS:
        expected = f"one of {', '.join(CATEGORIES)}"
        raise InputError(field="category", expected=expected, received=category)
    return _BUILDERS[category](rng, large)
