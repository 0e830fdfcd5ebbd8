"""REVERIE's object boxes, in one file and in its folder."""

import gzip
import itertools
import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings

from tests.fuzz import refused_or_read, texts
from tests.grids import grid_graph
from vlnhijack.errors import InputError
from vlnhijack.navigation.graph import NavigationGraph
from vlnhijack.scenes.reverie import Sighting, stream_sightings

GRAPHS = {name: grid_graph(name) for name in ("east", "west")}
SOFA = {"name": "sofa#chair", "visible_pos": [12, 13], "bbox2d": [[0, 0, 640, 120], [5, 5, 9, 9]]}
LAMP: dict[str, Any] = {"name": "lamp", "visible_pos": [], "bbox2d": []}
ENTRIES: dict[str, dict[str, Any]] = {
    "east_east03": {"17": SOFA, "4": LAMP},
    "west_west00": {"17": LAMP},
}


def test_one_file_of_all_viewpoints(tmp_path: Path) -> None:
    file = tmp_path / "boxes.json.gz"
    file.write_bytes(gzip.compress(json.dumps(ENTRIES).encode()))
    sofa, lamp, other = stream_sightings(file, GRAPHS)
    boxes = {12: (0, 0, 640, 120), 13: (5, 5, 9, 9)}
    assert sofa == Sighting("east", "east03", "17", "sofa chair", boxes)
    assert sofa.largest == 0.25
    assert (lamp.object_id, lamp.largest) == ("4", 0)
    assert (other.scan, other.viewpoint, other.object_id) == ("west", "west00", "17")


def test_a_folder_of_single_viewpoints(tmp_path: Path) -> None:
    for key, objects in ENTRIES.items():
        scan, viewpoint = key.split("_")
        (tmp_path / f"{key}.json").write_text(json.dumps({viewpoint: objects}))
        assert scan in GRAPHS
    found = list(stream_sightings(tmp_path, GRAPHS))
    together = tmp_path / "all.json"
    together.write_text(json.dumps(ENTRIES))
    assert found == list(stream_sightings(together, GRAPHS))


def test_scans_and_viewpoints_may_have_underscores(tmp_path: Path) -> None:
    graph = GRAPHS["east"]
    names = tuple(f"{name}_x" for name in graph.viewpoints)
    odd = NavigationGraph("e_a_st", names, graph.positions, graph.adjacency, graph.heights)
    file = tmp_path / "boxes.json"
    file.write_text(json.dumps({"e_a_st_east03_x": {"1": LAMP}}))
    (seen,) = stream_sightings(file, {"e_a_st": odd})
    assert (seen.scan, seen.viewpoint) == ("e_a_st", "east03_x")


@pytest.mark.parametrize(
    ("entries", "expected"),
    [
        ({"east_nowhere": {}}, "east_nowhere: expected <scan>_<viewpoint>"),
        ({"east_east03": {"1": LAMP | {"visible_pos": [3]}}}, "1: bbox2d: expected 1 boxes"),
        (
            {"east_east03": {"1": SOFA | {"visible_pos": [3, 3]}}},
            "1: visible_pos: expected distinct views, received 3",
        ),
        (
            {"east_east03": {"1": SOFA | {"visible_pos": [3, 36]}}},
            r"east_east03: 1\.visible_pos\.1: expected less than 36, received 36",
        ),
        (
            {"east_east03": {"1": SOFA | {"bbox2d": [[1, 0, 640, 1], [0, 0, 1, 1]]}}},
            r"1: bbox2d: expected a box inside 640 × 480 pixels, received \[1, 0, 640, 1\]",
        ),
        ({"east_east03": {"1": {"name": "sofa"}}}, "visible_pos: expected a value"),
    ],
)
def test_a_bad_entry_is_named(tmp_path: Path, entries: Any, expected: str) -> None:
    file = tmp_path / "boxes.json"
    file.write_text(json.dumps(entries))
    with pytest.raises(InputError, match=rf"boxes\.json: .*{expected}"):
        list(stream_sightings(file, GRAPHS))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('{"east_east03": {}, "east_east03": {}}', "east_east03: expected a text that is no key"),
        ('{"east_east03": {"1": 0, "1": 0}}', "east_east03: expected each key once, received '1'"),
    ],
)
def test_what_comes_twice_is_refused(tmp_path: Path, text: str, expected: str) -> None:
    (tmp_path / "boxes.json").write_text(text)
    with pytest.raises(InputError, match=rf"boxes\.json: {expected}"):
        list(stream_sightings(tmp_path / "boxes.json", GRAPHS))


def test_entries_are_read_one_at_a_time(tmp_path: Path) -> None:
    file = tmp_path / "boxes.json"
    file.write_text(json.dumps(ENTRIES)[:-1] + ", broken")
    assert len(list(itertools.islice(stream_sightings(file, GRAPHS), 3))) == 3


def test_a_bad_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="<scan>_<viewpoint>.json files"):
        list(stream_sightings(tmp_path, GRAPHS))
    (tmp_path / "east_east03.json").write_text(json.dumps({"east04": {}}))
    with pytest.raises(InputError, match="east04: expected east03, received 'east04'"):
        list(stream_sightings(tmp_path, GRAPHS))


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("reverie") / "boxes.json"


@settings(max_examples=200, deadline=None)
@given(texts(ENTRIES))
def test_no_file_ends_in_a_traceback(file: Path, content: bytes) -> None:
    refused_or_read(file, content, lambda path: list(stream_sightings(path, GRAPHS)))
