"""Rooms around a point."""

import pytest

from vlnhijack.scenes.house import Room, nearest_room

ROOMS = [
    Room("hall", "hallway", (0, 0, 4, 4)),
    Room("bath", "bathroom", (6, 0, 8, 2)),
    Room("loft", "office", (6, 6, 8, 8)),
]


@pytest.mark.parametrize(
    ("x", "y", "expected"),
    [(2, 2, "hall"), (7, 1, "bath"), (4.9, 1, "hall"), (5.1, 1, "bath"), (5.2, 3.5, "hall")],
)
def test_the_nearest_room(x: float, y: float, expected: str) -> None:
    assert nearest_room(ROOMS, x, y).id == expected


def test_corners_are_farther_than_sides() -> None:
    rooms = [Room("diagonal", "office", (2, 2, 3, 3)), Room("ahead", "office", (-5, 2.2, 0, 3))]
    assert nearest_room(rooms, 0.0, 0.0).id == "ahead"
