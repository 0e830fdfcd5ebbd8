"""The navigation graph of one scan, in Matterport3D's connectivity form."""

import lzma
import tarfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import networkx as nx
import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from vlnhijack.artifacts import parse_json, read_json, validated, write_json
from vlnhijack.errors import InputError

UPRIGHT = np.array([[-1.0, 0, 0], [0, 0, -1], [0, -1, 0]])
_SUFFIX = "_connectivity.json"
_FILE_NAME = r"^[^/\\\s\x00]*[^/\\\s\x00.][^/\\\s\x00]*$"  # pictures are named by viewpoints
_Finite = Annotated[float, Field(allow_inf_nan=False)]


class _Record(BaseModel):
    model_config = ConfigDict(strict=True)
    image_id: Annotated[str, Field(pattern=_FILE_NAME)]
    pose: Annotated[list[_Finite], Field(min_length=16, max_length=16)]
    included: bool
    unobstructed: list[bool]
    height: _Finite


_RECORD = TypeAdapter(_Record)
_LIST = TypeAdapter(list[Any])


@dataclass(frozen=True, eq=False)
class NavigationGraph:
    """Viewpoints and the edges between them.

    viewpoints: N ids; positions (N,3) float64 metres, the camera's centre at eye height;
    adjacency (N,N) bool, symmetric; heights (N,) metres of the camera above the floor; rotations
    (N,3,3) from the axes of the skybox images to the world, by default UPRIGHT: the image in front
    looks along +y (see `scenes.matterport.skybox`).
    """

    scan: str
    viewpoints: tuple[str, ...]
    positions: NDArray[np.float64]
    adjacency: NDArray[np.bool_]
    heights: NDArray[np.float64]
    rotations: NDArray[np.float64] = field(default_factory=lambda: UPRIGHT[None])

    def __post_init__(self) -> None:
        shape = (len(self.viewpoints), 3, 3)
        object.__setattr__(self, "rotations", np.broadcast_to(self.rotations, shape))

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

    def shortest_paths(self, source: str) -> dict[str, list[str]]:
        """Shortest paths, both ends included, to every viewpoint that can be reached."""
        if source not in self.graph:
            return {source: [source]}
        paths: dict[str, list[str]] = nx.single_source_dijkstra_path(self.graph, source)
        return paths

    def length(self, path: Sequence[str]) -> float:
        """Length in metres of a path, from viewpoint to viewpoint in a straight line."""
        steps = np.diff(self.positions[[self.row(viewpoint) for viewpoint in path]], axis=0)
        return float(np.linalg.norm(steps, axis=1).sum())

    def neighbours(self, viewpoint: str) -> list[str]:
        """Adjacent viewpoints in the order of the connectivity file."""
        return [self.viewpoints[j] for j in np.flatnonzero(self.adjacency[self.row(viewpoint)])]


def load_graph(folder: Path, scan: str) -> NavigationGraph:
    """Read `<folder>/<scan>_connectivity.json`; viewpoints not `included` are left out.

    Raises InputError with file, record and field where the form is not Matterport3D's.
    """
    path = folder / f"{scan}{_SUFFIX}"
    return _graph(scan, read_json(path), path)


class GraphFolder(Mapping[str, NavigationGraph]):
    """The graphs of a connectivity folder or .tar(.gz) archive by scan, read when asked for.

    Raises InputError where there is no such folder or archive, or no graph in it.
    """

    def __init__(self, source: Path) -> None:
        self._source = source
        self._graphs: dict[str, NavigationGraph] = {}
        self._texts = _archived(source) if source.is_file() else {}
        names = self._texts or {path.name for path in source.glob(f"*{_SUFFIX}")}
        if not names:
            raise InputError(
                file=source, expected=f"a folder or archive of *{_SUFFIX}", received="none"
            )
        self._scans = sorted(name.removesuffix(_SUFFIX) for name in names)

    def __getitem__(self, scan: str) -> NavigationGraph:
        if scan not in self._scans:
            raise KeyError(scan)
        if scan not in self._graphs:
            self._graphs[scan] = self._read(scan)
        return self._graphs[scan]

    def __contains__(self, scan: object) -> bool:
        return scan in self._scans

    def __iter__(self) -> Iterator[str]:
        return iter(self._scans)

    def __len__(self) -> int:
        return len(self._scans)

    def _read(self, scan: str) -> NavigationGraph:
        name = f"{scan}{_SUFFIX}"
        if name not in self._texts:
            return load_graph(self._source, scan)
        path = self._source / name
        return _graph(scan, parse_json(self._texts[name], path), path)


def scan_graph(source: Path, scan: str) -> NavigationGraph:
    """The graph of a scan in a folder or archive; InputError where it has none."""
    graphs = GraphFolder(source)
    if scan not in graphs:
        raise InputError(file=source, expected=f"{scan}{_SUFFIX}", received="no such file")
    return graphs[scan]


def _archived(source: Path) -> dict[str, bytes]:
    """The connectivity files of an archive by name, unparsed."""
    try:
        with tarfile.open(source) as archive:
            members = [m for m in archive if m.isfile() and m.name.endswith(_SUFFIX)]
            files = [(Path(member.name).name, archive.extractfile(member)) for member in members]
            return {name: file.read() for name, file in files if file is not None}
    except (tarfile.TarError, zlib.error, lzma.LZMAError, EOFError, OSError) as error:
        raise InputError(f"not a readable archive ({error})", file=source) from None


def _graph(scan: str, content: Any, path: Path) -> NavigationGraph:
    entries = validated(_LIST, content, path)
    records = [validated(_RECORD, e, path, f"record {row}") for row, e in enumerate(entries)]
    for row, record in enumerate(records):
        if len(record.unobstructed) != len(records):
            raise InputError(
                file=path,
                field=f"record {row}: unobstructed",
                expected=f"{len(records)} values",
                received=len(record.unobstructed),
            )
    kept = [row for row, record in enumerate(records) if record.included]
    names = tuple(records[row].image_id for row in kept)
    for row, name in zip(kept, names, strict=True):
        if names.count(name) > 1:
            raise InputError(
                file=path, field=f"record {row}: image_id", expected="one record", received=name
            )
    if not kept:
        raise InputError(file=path, expected="≥ 1 included viewpoint", received=0)
    poses = np.array([records[row].pose for row in kept], float).reshape(-1, 4, 4)
    edges = np.array([np.array(records[row].unobstructed)[kept] for row in kept])
    heights = np.array([records[row].height for row in kept], float)
    positions, rotations = poses[:, :3, 3], poses[:, :3, :3]
    return NavigationGraph(scan, names, positions, edges | edges.T, heights, rotations)


def save_graph(graph: NavigationGraph, folder: Path) -> None:
    """Write `<folder>/<scan>_connectivity.json`."""
    records: list[dict[str, Any]] = []
    for row, name in enumerate(graph.viewpoints):
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = graph.rotations[row], graph.positions[row]
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
    write_json(folder / f"{graph.scan}{_SUFFIX}", records)
