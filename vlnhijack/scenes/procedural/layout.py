"""Furnish a floor plan: recipes by room label, then what the house still lacks."""

from collections import Counter
from collections.abc import Callable

import numpy as np

from vlnhijack.scenes.procedural.floor_plan import FloorPlan
from vlnhijack.scenes.procedural.furniture import ATTACKABLE
from vlnhijack.scenes.procedural.room_layout import Placement, RoomLayout

FEWEST_OF_EACH = 3
FEWEST = 32


def furnish(plan: FloorPlan, rng: np.random.Generator) -> list[Placement]:
    """At least 32 pieces; at least three of each attackable category where there is room."""
    rooms = [RoomLayout(plan, index, rng) for index in range(len(plan.rooms))]
    for room in rooms:
        RECIPES[room.room.label](room)
    _top_up(rooms, rng)
    return [placement for room in rooms for placement in room.placed]


def _top_up(rooms: list[RoomLayout], rng: np.random.Generator) -> None:
    """Add attackable pieces, rare categories first, until there are enough."""
    spare = ("bathroom", "hallway", "kitchen")
    habitable = [room for room in rooms if room.room.label not in spare]
    for _ in range(60):
        counts = Counter(p.piece.category for room in rooms for p in room.placed)
        rare = [name for name in ATTACKABLE if counts[name] < FEWEST_OF_EACH]
        if not rare and counts.total() >= FEWEST:
            return
        category = str(rng.choice(rare or ATTACKABLE))
        room = habitable[rng.integers(len(habitable))]
        if category == "tv_monitor":
            _television(room)
        else:
            large = bool(rng.random() < 0.5)
            room.against_wall(category, large=large, corner=category == "plant")


def _hang(room: RoomLayout, category: str = "picture", *, large: bool = False) -> None:
    room.against_wall(category, large=large, z=1.2)


def _television(room: RoomLayout, viewer: Placement | None = None) -> None:
    """A television on its stand or on a low cabinet, before a sofa or a bed if there is one."""

    def put(category: str, *, large: bool = False) -> Placement | None:
        if viewer is not None:
            return room.opposite(viewer, category, large=large)
        return room.against_wall(category, large=large)

    if room.rng.random() < 0.7 and put("tv_monitor", large=True) is not None:
        return
    for _ in range(3):
        cabinet = put("cabinet")
        if cabinet is None or room.on_top(cabinet, "tv_monitor") is not None:
            return
        room.placed.remove(cabinet)


def _living_room(room: RoomLayout) -> None:
    sofa = room.against_wall("sofa", large=True)
    if sofa is not None:
        _television(room, sofa)
        room.in_front(sofa, "rug", 0.05)
        room.in_front(sofa, "table", 0.45)
        room.beside(sofa, "lamp")
    room.against_wall("sofa")
    room.against_wall("plant", large=True, corner=True)
    room.against_wall(str(room.rng.choice(["fireplace", "piano", "shelf"])))
    room.against_wall("cabinet", large=True)
    room.against_wall("chair", large=True)
    _hang(room)
    _hang(room)


def _dining_room(room: RoomLayout) -> None:
    _table_with_chairs(room, 4, large=True)
    room.against_wall("cabinet", large=True)
    room.against_wall("plant", corner=True)
    _hang(room)


def _kitchen(room: RoomLayout) -> None:
    _table_with_chairs(room, 2, large=False)
    counter = room.against_wall("counter")
    for category in ("stove", "fridge", str(room.rng.choice(["sink", "cabinet"]))):
        if counter is None or room.beside(counter, category) is None:
            room.against_wall(category)
    room.against_wall("cabinet", large=True)
    room.against_wall("plant", corner=True)


def _bedroom(room: RoomLayout) -> None:
    bed = room.against_wall("bed", large=True)
    if bed is not None:
        nightstand = room.beside(bed, "nightstand")
        if nightstand is not None:
            room.on_top(nightstand, "table_lamp")
        _television(room, bed)
    room.against_wall("cabinet", large=True)
    room.against_wall("chair", large=True)
    room.against_wall("plant", corner=True)
    _hang(room)


def _office(room: RoomLayout) -> None:
    desk = room.against_wall("desk")
    if desk is not None:
        room.in_front(desk, "chair", -0.12, facing=True)
    room.against_wall("sofa")
    room.against_wall("shelf")
    _television(room)
    room.against_wall("plant", large=True, corner=True)
    _hang(room)


def _bathroom(room: RoomLayout) -> None:
    for category in ("bathtub", "toilet", "washbasin", "cabinet"):
        room.against_wall(category)


def _hallway(room: RoomLayout) -> None:
    room.against_wall("cabinet")
    room.against_wall(str(room.rng.choice(["bench", "chair"])))
    room.against_wall("coat_stand", corner=True)
    room.against_wall("plant", corner=True)
    _hang(room, "mirror")
    _hang(room)


def _table_with_chairs(room: RoomLayout, count: int, *, large: bool) -> None:
    """A table in the middle of the room or, where that blocks the way, at a wall."""
    x0, y0, x1, y1 = room.room.bounds
    table = room.in_the_middle("table", large=large) if min(x1 - x0, y1 - y0) > 3.7 else None
    table = table or room.against_wall("table", large=large)
    if table is not None:
        room.around(table, "chair", count)


RECIPES: dict[str, Callable[[RoomLayout], None]] = {
    "living room": _living_room,
    "dining room": _dining_room,
    "kitchen": _kitchen,
    "bedroom": _bedroom,
    "office": _office,
    "bathroom": _bathroom,
    "hallway": _hallway,
}
