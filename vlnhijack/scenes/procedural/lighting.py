"""Lamps below the ceilings and daylight in the windows."""

from collections.abc import Iterator

import numpy as np

from vlnhijack.scenes.house import Light, Room
from vlnhijack.scenes.procedural.floor_plan import FloorPlan, Window
from vlnhijack.scenes.procedural.walls import pane

EXPOSURE = 1.5
BRIGHTNESS = 0.30
SKY = np.array([0.55, 0.80, 1.10])
LAMP = 0.45
LAMP_SPACING = 3.6

Vector = tuple[float, float, float]


def make_lights(plan: FloorPlan, rng: np.random.Generator) -> tuple[Light, ...]:
    """Square lamps of 0.9 m, one every 3.6 m of a room, and every window's pane as blue light."""
    lamps = [lamp for room in plan.rooms for lamp in _lamps(room, plan.height, rng)]
    return (*lamps, *(_daylight(plan, window) for window in plan.windows))


def _lamps(room: Room, height: float, rng: np.random.Generator) -> Iterator[Light]:
    """Lamps whose light, spread over all of the room's surfaces, has the wanted brightness."""
    x0, y0, x1, y1 = room.bounds
    width, depth = x1 - x0, y1 - y0
    columns, rows = (max(1, round(side / LAMP_SPACING)) for side in (width, depth))
    surface = 2 * (width * depth + height * (width + depth))
    strength = BRIGHTNESS / EXPOSURE * surface / (columns * rows * (2 * LAMP) ** 2)
    warmth = rng.uniform(0, 1)
    radiance = strength * (np.array([1.0, 0.97, 0.92]) - warmth * np.array([0.0, 0.05, 0.14]))
    for column in range(columns):
        for row in range(rows):
            centre = (
                x0 + width * (column + 0.5) / columns,
                y0 + depth * (row + 0.5) / rows,
                height - 0.03,
            )
            yield Light(centre, (LAMP, 0.0, 0.0), (0.0, -LAMP, 0.0), _vector(radiance))


def _daylight(plan: FloorPlan, window: Window) -> Light:
    """The pane as an emitter that faces the room."""
    low, high = (np.array(corner) for corner in pane(plan, window))
    half = (high - low) / 2
    along, up = np.array([half[0], half[1], 0.0]), np.array([0.0, 0.0, half[2]])
    if np.cross(along, up)[window.axis] * window.sign > 0:
        along = -along
    return Light(_vector((low + high) / 2), _vector(along), _vector(up), _vector(SKY / EXPOSURE))


def _vector(values: np.ndarray) -> Vector:
    x, y, z = values.tolist()
    return (x, y, z)
