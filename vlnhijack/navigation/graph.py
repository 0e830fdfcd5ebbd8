"""The navigation graph of one scan, in Matterport3D's connectivity form."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
from numpy.typing import NDArray

from vlnhijack.artifacts import read_json, write_json
from vlnhijack.errors import InputError


@dataclass(frozen=True, eq=False)
class NavigationGraph:
    """Viewpoints and the edges between them.

    viewpoints: N ids; positions (N,3) float64 metres, the camera's centre at eye height;
    adjacency (N,N) bool, symmetric; heights (N,) metres of the camera above the floor.
    """

    scan: str
    viewpoints: tuple[str, ...]
    positions: NDArray[np.float64]
    adjacency: NDArray[np.bool_]
    heights: NDArray[np.float64]

    @cached_property
    def index(self) -> dict[str, int]:
        """Row of every viewpoint id."""
        return {name: row for row, name in enumerate(self.viewpoints)}

    @cached_property
    def graph(self) -> nx.Graph:
        """networkx graph of the ids, edges weighted by Euclidean length in metres."""
        graph = nx.Graph()
        for i, j in zip(*np.nonzero(np.triu(self.adjacency, 1)), strict=True):
            length = float(np.linalg.norm(self.positions[i] - self.positions[j]))
            graph.add_edge(self.viewpoints[i], self.viewpoints[j], weight=length)
        return graph

    @cached_property
    def distances(self) -> NDArray[np.float64]:
        """Geodesic distances (N,N) in metres; infinite where there is no path."""
        distances = np.full((len(self.viewpoints),) * 2, np.inf)
        np.fill_diagonal(distances, 0.0)
        for source, lengths in nx.all_pairs_dijkstra_path_length(self.graph):
            for target, length in lengths.items():
                distances[self.index[source], self.index[target]] = length
        return distances

    def row(self, viewpoint: str) -> int:
        """Row of a viewpoint; InputError if the scan has none of that id."""
        if viewpoint not in self.index:
            raise InputError(
                file=self.scan,
                field="viewpoint",
                expected=f"one of the {len(self.viewpoints)} viewpoints",
                received=viewpoint,
            )
        return self.index[viewpoint]

    def distance(self, source: str, target: str) -> float:
        """Geodesic distance in metres."""
        return float(self.distances[self.row(source), self.row(target)])

    def shortest_path(self, source: str, target: str) -> list[str]:
        """Viewpoints of the shortest path, both ends included."""
        return list(nx.dijkstra_path(self.graph, source, target))

    def neighbours(self, viewpoint: str) -> list[str]:
        """Adjacent viewpoints in the order of the connectivity file."""
        return [self.viewpoints[j] for j in np.flatnonzero(self.adjacency[self.row(viewpoint)])]


def load_graph(folder: Path, scan: str) -> NavigationGraph:
    """Read `<folder>/<scan>_connectivity.json`; viewpoints not `included` are left out.

    Raises InputError with file and field where the form is not Matterport3D's.
    """
    path = folder / f"{scan}_connectivity.json"
    records = read_json(path)
    try:
        kept = [row for row, record in enumerate(records) if record["included"]]
        poses = np.array([records[row]["pose"] for row in kept], float).reshape(-1, 4, 4)
        edges = np.array([np.asarray(records[row]["unobstructed"], bool)[kept] for row in kept])
        names = tuple(str(records[row]["image_id"]) for row in kept)
        heights = np.array([float(records[row]["height"]) for row in kept])
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise InputError(
            f"not a Matterport3D connectivity file ({type(error).__name__}: {error})", file=path
        ) from None
    if not kept:
        raise InputError(file=path, expected="≥ 1 included viewpoint", received=0)
    return NavigationGraph(scan, names, poses[:, :3, 3], edges | edges.T, heights)


def save_graph(graph: NavigationGraph, folder: Path) -> None:
    """Write `<folder>/<scan>_connectivity.json`."""
    records: list[dict[str, Any]] = []
    for row, name in enumerate(graph.viewpoints):
        pose = np.eye(4)
        pose[:3, 3] = graph.positions[row]
        records.append(
            {
                "image_id": name,
                "pose": pose.ravel().tolist(),
                "included": True,
                "visible": graph.adjacency[row].tolist(),
                "unobstructed": graph.adjacency[row].tolist(),
                "height": float(graph.heights[row]),
            }
        )
    write_json(folder / f"{graph.scan}_connectivity.json", records)
