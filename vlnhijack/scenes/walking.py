"""Navigation graphs: where a person can stand, and which steps they can walk.

Spacing and degrees follow Matterport3D's graphs (about 2.2 m between neighbours, 1.5 m eye height).
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations, product

import networkx as nx
import numpy as np
import trimesh
from numpy.typing import NDArray

from vlnhijack.navigation.graph import NavigationGraph
from vlnhijack.scenes.lookouts import lookouts
from vlnhijack.seeds import stream

EYE_HEIGHT = 1.5
SPACING = 1.5
LONGEST_STEP = 2.9
CLEARANCE = 0.25
ATTEMPTS = 8
HIGHEST_DEGREE = 6

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FreeSpace:
    """Where one can stand on a floor.

    places (P,2) metres with CLEARANCE on all sides, doorways first; doorways: how many of them;
    clearance: metres (K,) from points (K,2) to the nearest obstacle; mesh: what blocks rays;
    floor: its height.
    """

    places: Array
    doorways: int
    clearance: Callable[[Array], Array]
    mesh: trimesh.Trimesh
    floor: float = 0.0


def walking_graph(
    name: str,
    seed: int,
    space: FreeSpace,
    landmarks: Sequence[trimesh.Trimesh],
    most: int,
    accept: Callable[[Array], bool],
) -> NavigationGraph | None:
    """A connected graph of at most `most` viewpoints, of eight drawn the one with the most edges
    and landmarks among those whose places (N,2) are accepted; None where there is none.

    Each landmark gets a viewpoint, if there is a place, that sees it large.
    """
    height = space.floor + EYE_HEIGHT
    eyes = np.column_stack([space.places, np.full(len(space.places), height)])
    near = [lookouts(eyes, piece, stream(seed, "lookouts")) for piece in landmarks]
    best: tuple[int, Array, nx.Graph] | None = None
    for attempt in range(ATTEMPTS):
        rows = _grow(space, near, most, stream(seed, "viewpoints", attempt))
        chosen = space.places[rows]
        if not accept(chosen):
            continue
        graph = _steps(chosen, space)
        seen = sum(bool(np.isin(rows, landmark).any()) for landmark in near)
        score = graph.size() + 2 * seen
        if nx.is_connected(graph) and (best is None or score > best[0]):
            best = score, chosen, graph
    return None if best is None else _navigation_graph(name, seed, height, *best[1:])


def _navigation_graph(
    name: str, seed: int, height: float, places: Array, graph: nx.Graph
) -> NavigationGraph:
    return NavigationGraph(
        name,
        tuple(stream(seed, name, "viewpoint", row).bytes(16).hex() for row in range(len(places))),
        np.column_stack([places, np.full(len(places), height)]),
        nx.to_numpy_array(graph, nodelist=range(len(places)), weight=None) > 0,
        np.full(len(places), EYE_HEIGHT),
    )


def _grow(
    space: FreeSpace, near: Sequence[NDArray[np.int64]], most: int, rng: np.random.Generator
) -> list[int]:
    """Rows of places, each a walkable step from an earlier one.

    Doorways keep their surroundings free and are taken as soon as they are in reach; then one place
    near each landmark; then the tightest packing that the spacing allows. Without doorways, the
    first is any place.
    """
    places = space.places
    count = space.doorways
    starts = rng.permutation(count) if count else rng.integers(len(places), size=1)
    kept = _spaced(places, starts)
    gaps = np.linalg.norm(places[:, None] - places[kept], axis=-1).min(axis=1)
    gaps[kept] = np.inf
    reach = np.zeros(len(places), bool)
    pending = [near[index] for index in rng.permutation(len(near))]
    chosen: list[int] = []
    row: int | None = kept[0]
    while row is not None and len(chosen) < most:
        chosen.append(row)
        distance = np.linalg.norm(places - places[row], axis=1)
        gaps = np.minimum(gaps, distance)
        around = np.flatnonzero((distance <= LONGEST_STEP) & (gaps >= SPACING) & ~reach)
        pairs = np.stack([np.full(len(around), row), around], axis=-1)
        reach[around] = _is_walkable(places, pairs, space)
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


def _steps(places: Array, space: FreeSpace) -> nx.Graph:
    """Walkable steps of up to 2.9 m, short ones first, that pass no other viewpoint."""
    gaps = np.linalg.norm(places[:, None] - places, axis=-1)
    pairs = [p for p in combinations(range(len(places)), 2) if gaps[p] <= LONGEST_STEP]
    pairs = [p for p in pairs if not _skips(places, *p)]
    free = _is_walkable(places, np.array(pairs), space)
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


def _is_walkable(places: Array, pairs: NDArray[np.int64], space: FreeSpace) -> NDArray[np.bool_]:
    """Which pairs (E,2) see each other at three heights and abreast, clear of all furniture."""
    if len(pairs) == 0:
        return np.zeros(0, bool)
    start, step = places[pairs[:, 0]], places[pairs[:, 1]] - places[pairs[:, 0]]
    length = np.linalg.norm(step, axis=1)
    ahead = step / length[:, None]
    aside = np.stack([ahead[:, 1], -ahead[:, 0]], axis=-1)
    samples = start[:, None] + np.linspace(0, 1, 40)[:, None] * step[:, None]
    clear = space.clearance(samples.reshape(-1, 2)).reshape(len(pairs), -1)
    free = np.asarray((clear >= 0.15).all(axis=1))
    for offset, z in product((-0.15, 0.0, 0.15), (0.2, 0.9, EYE_HEIGHT)):
        origins = np.column_stack([start + offset * aside, np.full(len(pairs), space.floor + z)])
        directions = np.column_stack([ahead, np.zeros(len(pairs))])
        free &= _free_length(space.mesh, origins, directions) > length
    return free


def _free_length(mesh: trimesh.Trimesh, origins: Array, directions: Array) -> Array:
    """Metres (E,) that each ray travels before it hits the mesh."""
    places, rays, _ = mesh.ray.intersects_location(origins, directions, multiple_hits=False)
    lengths = np.full(len(origins), np.inf)
    lengths[rays] = np.linalg.norm(places - origins[rays], axis=1)
    return lengths
