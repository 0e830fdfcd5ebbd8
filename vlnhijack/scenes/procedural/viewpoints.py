"""Navigation graphs for floor plans: where a person can stand, and which steps they can walk."""

from collections.abc import Sequence

import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray

from vlnhijack.navigation.graph import NavigationGraph
from vlnhijack.scenes.procedural.floor_plan import FloorPlan
from vlnhijack.scenes.walking import CLEARANCE, FreeSpace, walking_graph

FEWEST, MOST = 32, 44

Array = NDArray[np.float64]


def make_graph(
    name: str,
    seed: int,
    plan: FloorPlan,
    obstacles: Array,
    landmarks: Sequence[trimesh.Trimesh],
    mesh: trimesh.Trimesh,
) -> NavigationGraph | None:
    """A connected graph of 32-44 viewpoints that reaches every room; None where there is none.

    obstacles (B,4) are the boxes x0, y0, x1, y1 to stay clear of; see `walking_graph`.
    """
    doorways = _doorway_centres(plan, obstacles)
    space = FreeSpace(
        places=np.concatenate([doorways, standing_places(plan, obstacles)]),
        doorways=len(doorways),
        clearance=lambda points: distance_to_boxes(points, obstacles),
        mesh=mesh,
    )

    def accept(places: Array) -> bool:
        return len(places) >= FEWEST and _reaches_every_room(places, plan)

    return walking_graph(name, seed, space, landmarks, MOST, accept)


def standing_places(plan: FloorPlan, obstacles: Array, step: float = 0.1) -> Array:
    """Grid points (P,2) in rooms or doorways with 0.25 m of clearance on all sides."""
    bounds = np.array([room.bounds for room in plan.rooms])
    low, high = bounds[:, :2].min(axis=0), bounds[:, 2:].max(axis=0)
    grid = np.stack(
        np.meshgrid(*(np.arange(a, b, step) for a, b in zip(low, high, strict=True))), axis=-1
    ).reshape(-1, 2)
    inside = walkable(plan, grid) & (distance_to_boxes(grid, obstacles) >= CLEARANCE)
    return grid[inside]


def walkable(plan: FloorPlan, points: Array) -> NDArray[np.bool_]:
    """Which points (P,2) are 0.25 m clear of the walls: in rooms or in the middle of doorways."""
    bounds = np.array([room.bounds for room in plan.rooms])
    inside = (_overhang(points, bounds) <= -CLEARANCE).any(axis=1)
    passages = np.array([_passage(plan, row) for row in range(len(plan.doorways))])
    return np.asarray(inside | (_overhang(points, passages) <= 0).any(axis=1))


def distance_to_boxes(points: ArrayLike, boxes: Array) -> Array:
    """Distances (P,) from points (P,2) to the nearest of boxes (B,4); infinite for no boxes."""
    p = np.asarray(points, float)[:, None]
    outside = np.maximum(np.maximum(boxes[:, :2] - p, p - boxes[:, 2:]), 0)
    return np.linalg.norm(outside, axis=-1).min(axis=1, initial=np.inf)


def _overhang(points: Array, boxes: Array) -> Array:
    """(P,B) how far points are out of boxes on their worst side; negative inside."""
    p = points[:, None]
    return np.maximum(boxes[:, :2] - p, p - boxes[:, 2:]).max(axis=-1)


def _passage(plan: FloorPlan, row: int) -> tuple[float, float, float, float]:
    doorway = plan.doorways[row]
    x, y = doorway.position
    across, along = 0.35, doorway.width / 2 - CLEARANCE
    dx, dy = (across, along) if doorway.axis == 0 else (along, across)
    return (x - dx, y - dy, x + dx, y + dy)


def _doorway_centres(plan: FloorPlan, obstacles: Array) -> Array:
    centres = np.array([doorway.position for doorway in plan.doorways])
    return centres[distance_to_boxes(centres, obstacles) >= CLEARANCE]


def _reaches_every_room(places: Array, plan: FloorPlan) -> bool:
    bounds = np.array([room.bounds for room in plan.rooms])
    return bool((_overhang(places, bounds) <= 0).any(axis=0).all())
