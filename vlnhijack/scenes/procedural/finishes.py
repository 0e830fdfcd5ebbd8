"""What floors, walls and trims of each kind of room are made of."""

from collections.abc import Sequence

import numpy as np

from vlnhijack.scenes.procedural.floor_plan import FloorPlan
from vlnhijack.scenes.procedural.materials import Colour, Material, solid, wood
from vlnhijack.scenes.procedural.surroundings import (
    WALLS,
    carpet,
    parquet,
    plaster,
    tile,
    wainscot,
    wallpaper,
)

WHITE: Colour = (0.90, 0.90, 0.88)
TILED = ("kitchen", "bathroom")
CARPETED = ("bedroom", "office")

Finish = dict[str, Material]


def room_finishes(plan: FloorPlan, rng: np.random.Generator) -> list[Finish]:
    """A material for every material name of each room's shell; wall colours differ by room."""
    trim = solid(WHITE) if rng.random() < 0.6 else wood(rng)
    order = rng.permutation(len(WALLS))
    colours = [WALLS[order[row % len(WALLS)]] for row in range(len(plan.rooms))]
    return [
        {
            "floor": _floor(room.label, rng),
            "wall": _wall(room.label, colour, rng),
            "ceiling": plaster(rng, WHITE),
            "trim": trim,
            "threshold": wood(rng),
        }
        for room, colour in zip(plan.rooms, colours, strict=True)
    ]


def _floor(label: str, rng: np.random.Generator) -> Material:
    if label in TILED:
        return tile(rng)
    if label in CARPETED and rng.random() < 0.7:
        return carpet(rng)
    return parquet(rng)


def _wall(label: str, colour: Colour, rng: np.random.Generator) -> Material:
    if label in TILED:
        return tile(rng, colour, wall=True)
    factories: Sequence[Material] = (plaster(rng, colour), wallpaper(rng, colour), wainscot(rng))
    return factories[rng.choice(3, p=[0.45, 0.4, 0.15])]
