"""Connectivity files, one by one, in folders and in archives."""

import json
import tarfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings

from tests.fuzz import refused_or_read, texts
from tests.grids import grid_graph
from vlnhijack.errors import InputError
from vlnhijack.navigation.graph import UPRIGHT, GraphFolder, load_graph, save_graph

GRAPH = grid_graph("east")


def record(name: str, x: float, edges: list[bool], **changes: Any) -> dict[str, Any]:
    pose = [1.0, 0, 0, x, 0, 1, 0, 0, 0, 0, 1, 1.5, 0, 0, 0, 1]
    good = {"image_id": name, "pose": pose, "included": True, "height": 1.5}
    return good | {"visible": edges, "unobstructed": edges} | changes


RECORDS = [record("a", 0, [False, True]), record("b", 2, [True, False])]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("connectivity")
    for scan in ("west", "east"):
        save_graph(grid_graph(scan), folder)
    (folder / "scans.txt").write_text("east\nwest\n")
    return folder


@pytest.fixture(scope="module")
def archive(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("archive") / "connectivity.tar.gz"
    with tarfile.open(path, "w:gz") as tar:
        tar.add(folder, "connectivity")
    return path


@pytest.mark.parametrize("source", ["folder", "archive"])
def test_a_folder_and_an_archive_hold_the_same_graphs(
    request: pytest.FixtureRequest, source: str
) -> None:
    graphs = GraphFolder(request.getfixturevalue(source))
    assert list(graphs) == ["east", "west"]
    assert len(graphs) == 2
    assert "north" not in graphs
    assert graphs["east"] is graphs["east"]
    assert graphs["east"].viewpoints == GRAPH.viewpoints
    assert np.array_equal(graphs["east"].positions, GRAPH.positions)
    assert np.array_equal(graphs["east"].adjacency, GRAPH.adjacency)
    with pytest.raises(KeyError):
        graphs["north"]


def test_rotations_are_kept_and_upright_by_default(tmp_path: Path) -> None:
    turned = GRAPH.rotations.copy()
    turned[1] = turned[1] @ [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    save_graph(replace(GRAPH, rotations=turned), tmp_path)
    read = load_graph(tmp_path, "east")
    assert np.array_equal(read.rotations, turned)
    assert np.array_equal(read.rotations[0], UPRIGHT)


def test_a_graph_is_read_when_it_is_asked_for(tmp_path: Path) -> None:
    save_graph(GRAPH, tmp_path)
    (tmp_path / "bad_connectivity.json").write_text("[]")
    graphs = GraphFolder(tmp_path)
    assert graphs["east"].viewpoints == GRAPH.viewpoints
    with pytest.raises(InputError, match="bad_connectivity.json: expected ≥ 1 included viewpoint"):
        graphs["bad"]


def test_what_holds_no_graphs_is_refused(tmp_path: Path) -> None:
    (tmp_path / "broken.tar.gz").write_bytes(b"\x1f\x8b nothing")
    for name, expected in (("none", "folder or archive"), ("broken.tar.gz", "readable archive")):
        with pytest.raises(InputError, match=f"{name}: .*{expected}"):
            GraphFolder(tmp_path / name)


@pytest.mark.parametrize(
    ("records", "expected"),
    [
        ({}, "valid list"),
        ([RECORDS[0]], "record 0: unobstructed: expected 1 values, received 2"),
        ([RECORDS[0], record("a", 1, [True, False])], "record 0: image_id: .*'a'"),
        ([RECORDS[0], record("b", 1, [True, False], included=1)], "record 1: included"),
        ([RECORDS[0], record("b", float("nan"), [True, False])], r"record 1: pose\.3"),
        ([RECORDS[0], record("b", 1, [True, False], height="high")], "record 1: height"),
        ([RECORDS[0], record("../b", 1, [True, False])], "record 1: image_id: .*'../b'"),
        ([RECORDS[0], record("..", 1, [True, False])], "record 1: image_id: .*'..'"),
        ([RECORDS[0], record("b\\c", 1, [True, False])], "record 1: image_id"),
        ([RECORDS[0], record("b c", 1, [True, False])], "record 1: image_id: .*'b c'"),
        ([RECORDS[0], record("", 1, [True, False])], "record 1: image_id"),
        ([RECORDS[0], record("b\0", 1, [True, False])], "record 1: image_id"),
        ([RECORDS[0], {"image_id": "b"}], "record 1: pose: expected a value, received 'none'"),
    ],
)
def test_a_bad_record_is_named(tmp_path: Path, records: Any, expected: str) -> None:
    (tmp_path / "s_connectivity.json").write_text(json.dumps(records))
    with pytest.raises(InputError, match=rf"s_connectivity\.json: .*{expected}"):
        load_graph(tmp_path, "s")


def test_viewpoints_that_are_not_included_are_left_out(tmp_path: Path) -> None:
    third = record("c", 4, [True, True, False], included=False)
    wider = [r | {"unobstructed": [*r["unobstructed"], True]} for r in RECORDS]
    (tmp_path / "s_connectivity.json").write_text(json.dumps([*wider, third]))
    graph = load_graph(tmp_path, "s")
    assert graph.viewpoints == ("a", "b")
    assert graph.distance("a", "b") == graph.length(["a", "b"]) == 2


def test_all_shortest_paths_are_the_single_ones() -> None:
    for source in GRAPH.viewpoints:
        paths = GRAPH.shortest_paths(source)
        assert set(paths) == set(GRAPH.viewpoints)
        assert all(path == GRAPH.shortest_path(source, end) for end, path in paths.items())


@settings(max_examples=200, deadline=None)
@given(texts(RECORDS))
def test_no_connectivity_file_ends_in_a_traceback(folder: Path, content: bytes) -> None:
    file = folder / "fuzz_connectivity.json"
    refused_or_read(file, content, lambda file: load_graph(file.parent, "fuzz"))


@settings(max_examples=60, deadline=None)
@given(texts(RECORDS))
def test_no_archive_ends_in_a_traceback(folder: Path, content: bytes) -> None:
    refused_or_read(folder / "graphs.tar", content, lambda file: GraphFolder(file))
