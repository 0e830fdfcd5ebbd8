"""Navigation graphs for floor plans: where a person can stand, and which steps they can walk.

Spacing and degrees follow Matterport3D's graphs (about 2.2 m between neighbours, 1.5 m eye height).
"""

from collections.abc import Iterable, Sequence
from itertools import combinations, product

import networkx as nx
import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray

from vlnhijack.navigation.graph import NavigationGraph
from vlnhijack.scenes.procedural.floor_plan import FloorPlan
from vlnhijack.scenes.procedural.lookouts import lookouts
from vlnhijack.seeds import stream

EYE_HEIGHT = 1.5
SPACING = 1.5
LONGEST_STEP = 2.9
CLEARANCE = 0.25
FEWEST, MOST = 32, 44
ATTEMPTS = 8
HIGHEST_DEGREE = 6

Array = NDArray[np.float64]


def make_graph(
    name: str,
    seed: int,
    plan: FloorPlan,
    obstacles: Array,
    landmarks: Sequence[trimesh.Trimesh],
    mesh: trimesh.Trimesh,
) -> NavigationGraph | None:
    """A connected graph of 32-44 viewpoints that reaches every room, of eight drawn the one with
    the most edges and landmarks; None where there is none.

    obstacles (B,4) are the boxes x0, y0, x1, y1 to stay clear of; each of `landmarks` gets a
    viewpoint, if there is a place, that sees it large; steps are checked against `mesh` by rays.
    """
    doorways = _doorway_centres(plan, obstacles)
    places = np.concatenate([doorways, standing_places(plan, obstacles)])
    eyes = np.column_stack([places, np.full(len(places), EYE_HEIGHT)])
    near = [lookouts(eyes, piece, stream(seed, "lookouts")) for piece in landmarks]
    best: tuple[int, Array, nx.Graph] | None = None
    for attempt in range(ATTEMPTS):
        rng = stream(seed, "viewpoints", attempt)
        rows = _grow(places, len(doorways), near, obstacles, mesh, rng)
        chosen = places[rows]
        if len(chosen) < FEWEST or not _reaches_every_room(chosen, plan):
            continue
        graph = _steps(chosen, obstacles, mesh)
        seen = sum(bool(np.isin(rows, landmark).any()) for landmark in near)
        score = graph.size() + 2 * seen
        if nx.is_connected(graph) and (best is None or score > best[0]):
            best = score, chosen, graph
    return None if best is None else _navigation_graph(name, seed, *best[1:])


def _navigation_graph(name: str, seed: int, places: Array, graph: nx.Graph) -> NavigationGraph:
    heights = np.full(len(places), EYE_HEIGHT)
    return NavigationGraph(
        name,
        tuple(stream(seed, name, "viewpoint", row).bytes(16).hex() for row in range(len(places))),
        np.column_stack([places, heights]),
        nx.to_numpy_array(graph, nodelist=range(len(places)), weight=None) > 0,
        heights,
    )


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


def _grow(
    places: Array,
    doorways: int,
    near: Sequence[NDArray[np.int64]],
    obstacles: Array,
    mesh: trimesh.Trimesh,
    rng: np.random.Generator,
) -> list[int]:
    """Rows of places, each a walkable step from an earlier one.

    The first `doorways` places keep their surroundings free and are taken as soon as they are in
    reach; then one place near each landmark; then the tightest packing that the spacing allows.
    """
    kept = _spaced(places, rng.permutation(doorways))
    gaps = np.linalg.norm(places[:, None] - places[kept], axis=-1).min(axis=1)
    gaps[kept] = np.inf
    reach = np.zeros(len(places), bool)
    pending = [near[index] for index in rng.permutation(len(near))]
    chosen: list[int] = []
    row: int | None = kept[0]
    while row is not None and len(chosen) < MOST:
        chosen.append(row)
        distance = np.linalg.norm(places - places[row], axis=1)
        gaps = np.minimum(gaps, distance)
        around = np.flatnonzero((distance <= LONGEST_STEP) & (gaps >= SPACING) & ~reach)
        pairs = np.stack([np.full(len(around), row), around], axis=-1)
        reach[around] = _is_walkable(places, pairs, obstacles, mesh)
        pending = [rows for rows in pending if row not in rows]
        row = _next(reach & (gaps >= SPACING), kept, pending, gaps, rng)
    return chosen


def _next(
    free: NDArray[np.bool_],
    kept: Sequence[int],
    pending: list[NDArray[np.int64]],
    gaps: Array,
    rng: np.random.Generator,
) -> int | None:
    for row in kept:
        if free[row]:
            return row
    for rows in pending:
        if free[rows].any():
            return int(rows[free[rows]][0])
    if not free.any():
        return None
    order = gaps + rng.uniform(0, 0.15, len(gaps))
    return int(np.where(free, order, np.inf).argmin())


def _spaced(places: Array, rows: Iterable[int]) -> list[int]:
    """Those rows, in order, whose places keep the spacing from the earlier ones."""
    kept: list[int] = []
    for row in map(int, rows):
        if all(np.linalg.norm(places[row] - places[other]) >= SPACING for other in kept):
            kept.append(row)
    return kept


def _steps(places: Array, obstacles: Array, mesh: trimesh.Trimesh) -> nx.Graph:
    """Walkable steps of up to 2.9 m, short ones first, that pass no other viewpoint."""
    gaps = np.linalg.norm(places[:, None] - places, axis=-1)
    pairs = [p for p in combinations(range(len(places)), 2) if gaps[p] <= LONGEST_STEP]
    pairs = [p for p in pairs if not _skips(places, *p)]
    free = _is_walkable(places, np.array(pairs), obstacles, mesh)
    graph = nx.Graph()
    graph.add_nodes_from(range(len(places)))
    for i, j in sorted((p for p, ok in zip(pairs, free, strict=True) if ok), key=lambda p: gaps[p]):
        crowded = max(graph.degree[i], graph.degree[j]) >= HIGHEST_DEGREE
        if not crowded or not nx.has_path(graph, i, j):
            graph.add_edge(i, j)
    return graph


def _skips(places: Array, i: int, j: int) -> bool:
    """True if a step passes within 0.6 m of a third viewpoint that lies between its ends."""
    step = places[j] - places[i]
    share = (places - places[i]) @ step / (step @ step)
    aside = np.linalg.norm(places - places[i] - share[:, None] * step, axis=1)
    between = (share > 0.1) & (share < 0.9)
    return bool((between & (aside < 0.6)).any())


def _is_walkable(
    places: Array, pairs: NDArray[np.int64], obstacles: Array, mesh: trimesh.Trimesh
) -> NDArray[np.bool_]:
    """Which pairs (E,2) see each other at three heights and abreast, clear of all furniture."""
    if len(pairs) == 0:
        return np.zeros(0, bool)
    start, step = places[pairs[:, 0]], places[pairs[:, 1]] - places[pairs[:, 0]]
    length = np.linalg.norm(step, axis=1)
    ahead = step / length[:, None]
    aside = np.stack([ahead[:, 1], -ahead[:, 0]], axis=-1)
    samples = start[:, None] + np.linspace(0, 1, 40)[:, None] * step[:, None]
    clear = distance_to_boxes(samples.reshape(-1, 2), obstacles).reshape(len(pairs), -1)
    free = np.asarray((clear >= 0.15).all(axis=1))
    for offset, z in product((-0.15, 0.0, 0.15), (0.2, 0.9, EYE_HEIGHT)):
        origins = np.column_stack([start + offset * aside, np.full(len(pairs), z)])
        directions = np.column_stack([ahead, np.zeros(len(pairs))])
        free &= _free_length(mesh, origins, directions) > length
    return free


def _free_length(mesh: trimesh.Trimesh, origins: Array, directions: Array) -> Array:
    """Metres (E,) that each ray travels before it hits the mesh."""
    places, rays, _ = mesh.ray.intersects_location(origins, directions, multiple_hits=False)
    lengths = np.full(len(origins), np.inf)
    lengths[rays] = np.linalg.norm(places - origins[rays], axis=1)
    return lengths


def _reaches_every_room(places: Array, plan: FloorPlan) -> bool:
    bounds = np.array([room.bounds for room in plan.rooms])
    return bool((_overhang(places, bounds) <= 0).any(axis=0).all())
