"""Episodes for a procedural house: shortest paths, three instructions each, two splits."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.sparse import csr_array

from vlnhijack import seeds
from vlnhijack.frames import heading_of
from vlnhijack.navigation.episode import Episode
from vlnhijack.navigation.graph import NavigationGraph
from vlnhijack.scenes.house import House
from vlnhijack.scenes.procedural.facts import stop_facts
from vlnhijack.scenes.procedural.instructions import write_instruction, write_instructions
from vlnhijack.scenes.procedural.landmarks import Landmarks, find_landmarks

STEPS = range(4, 8)  # viewpoints of a path
SHORTEST = 5.0  # metres
INSTRUCTIONS = 3

Path = tuple[str, ...]


def make_episodes(
    house: House, seed: int, train_paths: int = 450, val_paths: int = 40
) -> tuple[list[Episode], list[Episode]]:
    """Episodes of the splits train and val_seen, three per path.

    Paths are shortest paths of four to seven viewpoints and at least 5 m that end near a landmark.
    A path of which a val_seen path is a part is not used at all; so val_seen paths are drawn with
    chances that fall with the root of the number of paths they are part of. A small graph gives
    fewer paths, in proportion, or none.
    """
    landmarks = find_landmarks(house)
    paths = [p for p in _shortest_paths(house.graph) if stop_facts(landmarks, p)]
    if not paths:
        return [], []
    rng = seeds.stream(seed, "episodes", house.name)
    val_paths = min(val_paths, len(paths) * val_paths // (train_paths + val_paths))
    whole = Counter(part for path in paths for part in _parts(path))
    chances = np.array([whole[path] ** -0.5 for path in paths])
    drawn = rng.choice(len(paths), val_paths, replace=False, p=chances / chances.sum())
    held_out = {paths[row] for row in drawn}
    free = [path for path in paths if not held_out & set(_parts(path))]
    train = _spread(free, min(train_paths, len(free)), rng)
    first = 1000 * (seeds.integer(0, "path_id", house.name) % 1_000_000)
    episodes = [
        _episodes(landmarks, path, first + number, seed)
        for number, path in enumerate([*train, *sorted(held_out)])
    ]
    return sum(episodes[: len(train)], []), sum(episodes[len(train) :], [])


def reword(house: House, episodes: Iterable[Episode], seed: int, count: int) -> list[Episode]:
    """`count` further episodes for each path: another first heading, another instruction.

    They augment training, as the speaker's instructions do for R2R agents (Fried et al. 2018).
    """
    landmarks = find_landmarks(house)
    paths = {episode.path_id: episode for episode in episodes}
    further = []
    for path_id, episode in paths.items():
        for number in range(count):
            rng = seeds.stream(seed, "reworded", path_id, number)
            heading = _first_heading(landmarks, episode.path, rng)
            text, _ = write_instruction(landmarks, episode.path, heading, rng)
            name = f"{path_id}_reworded_{number}"
            further.append(replace(episode, heading=heading, instruction=text, instruction_id=name))
    return further


def viewpoint_overlap(train: Iterable[Episode], other: Sequence[Episode]) -> float:
    """Mean share of the viewpoints of a path of `other` that train paths also visit."""
    known = {viewpoint for episode in train for viewpoint in episode.path}
    return float(np.mean([len(known & set(e.path)) / len(set(e.path)) for e in other]))


def _shortest_paths(graph: NavigationGraph) -> list[Path]:
    rows, columns = np.nonzero((graph.distances >= SHORTEST) & np.isfinite(graph.distances))
    ends = ((graph.viewpoints[i], graph.viewpoints[j]) for i, j in zip(rows, columns, strict=True))
    paths = (tuple(graph.shortest_path(*end)) for end in ends)
    return [path for path in paths if len(path) in STEPS]


def _parts(path: Path) -> list[Path]:
    """The contiguous parts of a path that could be paths themselves, the whole included."""
    return [
        path[start : start + length] for length in STEPS for start in range(len(path) - length + 1)
    ]


def _spread(paths: list[Path], count: int, rng: np.random.Generator) -> list[Path]:
    """`count` paths drawn one by one, each where the directed edges so far are used least."""
    edges = {edge: n for n, edge in enumerate(dict.fromkeys(e for p in paths for e in pairwise(p)))}
    rows = np.repeat(np.arange(len(paths)), [len(path) - 1 for path in paths])
    columns = [edges[edge] for path in paths for edge in pairwise(path)]
    shape = (len(paths), len(edges))
    uses = csr_array((np.ones(len(rows)), (rows, columns)), shape=shape)
    uses = csr_array(uses / uses.sum(axis=1)[:, None])
    used, noise = np.zeros(len(edges)), rng.random(len(paths))
    chosen: list[int] = []
    for _ in range(count):
        cost = uses @ used + noise
        cost[chosen] = np.inf
        chosen.append(int(cost.argmin()))
        used += uses[[chosen[-1]]].toarray()[0]
    return [paths[row] for row in chosen]


def _episodes(landmarks: Landmarks, path: Path, path_id: int, seed: int) -> list[Episode]:
    graph = landmarks.house.graph
    rng = seeds.stream(seed, "instructions", landmarks.house.name, *path)
    heading = _first_heading(landmarks, path, rng)
    texts = write_instructions(landmarks, path, heading, rng, INSTRUCTIONS)
    distance = round(graph.distance(path[0], path[-1]), 2)
    return [
        Episode(path_id, graph.scan, path, heading, text, f"{path_id}_{number}", distance)
        for number, text in enumerate(texts)
    ]


def _first_heading(landmarks: Landmarks, path: Path, rng: np.random.Generator) -> float:
    """Half of the walks start looking along the path, roughly; half in any direction."""
    along = float(heading_of(landmarks.position(path[1]) - landmarks.position(path[0])))
    heading = along + rng.normal(0, 0.25) if rng.random() < 0.5 else rng.uniform(0, 2 * np.pi)
    return round(float(heading % (2 * np.pi)), 4)
