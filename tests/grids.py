"""A small scan for tests: a grid of viewpoints, and walks through it."""

from itertools import pairwise

import numpy as np

from vlnhijack import seeds
from vlnhijack.navigation.episode import Episode
from vlnhijack.navigation.graph import NavigationGraph

COLUMNS, ROWS = 4, 3
WORDS = ("walk", "turn", "left", "right", "past", "the", "chair", "sofa", "lamp", "kitchen", "stop")


def grid_graph(scan: str) -> NavigationGraph:
    """4 × 3 viewpoints about 2 m apart, uneven: shortest paths are unique, one stands high."""
    random = seeds.stream(0, "grid", scan)
    column, row = np.meshgrid(np.arange(COLUMNS), np.arange(ROWS))
    flat = np.stack([column.ravel(), row.ravel(), np.full(COLUMNS * ROWS, 0.75)], 1) * 2.0
    positions = flat + random.uniform(-0.25, 0.25, flat.shape)
    positions[5, 2] += 1.5
    adjacency = np.abs(flat[:, None] - flat[None]).sum(-1) == 2
    adjacency[[0, 2], [2, 0]] = True  # seen in the same view as its neighbour 1
    names = tuple(f"{scan}{number:02d}" for number in range(len(flat)))
    return NavigationGraph(scan, names, positions, adjacency, np.full(len(flat), 1.5))


def walks(graph: NavigationGraph, shortest: int = 4) -> list[Episode]:
    """All shortest paths of at least that many viewpoints, three instructions each."""
    random = seeds.stream(0, "walks", graph.scan)
    episodes: list[Episode] = []
    for start in graph.viewpoints:
        for goal in graph.viewpoints:
            path = tuple(graph.shortest_path(start, goal))
            if len(path) < shortest:
                continue
            number = len(episodes) // 3
            heading = float(random.uniform(0, 2 * np.pi))
            length = sum(graph.distance(*step) for step in pairwise(path))
            for k in range(3):
                words = " ".join(random.choice(WORDS, size=random.integers(3, 9)))
                episodes.append(
                    Episode(number, graph.scan, path, heading, words, f"{number}_{k}", length)
                )
    return episodes
