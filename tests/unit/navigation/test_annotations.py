"""The official annotation files: what they may hold, and what is wrong with a bad one."""

import gzip
import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.fuzz import refused_or_read, texts
from tests.grids import grid_graph
from vlnhijack.errors import InputError
from vlnhijack.navigation.episode import load_episodes, save_episodes

GRAPH = grid_graph("east")
GRAPHS = {"east": GRAPH}
PATH = ["east00", "east01", "east05"]
R2R = {
    "scan": "east",
    "path_id": 7,
    "path": PATH,
    "heading": 1,
    "distance": 4.25,
    "instructions": ["Walk past the sofa.", "Stop."],
}
ENCODED = R2R | {"instr_encodings": [[101, 5, 102], [101, 9, 102]]}
RXR = {
    "scan": "east",
    "path_id": 11,
    "path": PATH,
    "heading": 3.1,
    "split": "val_seen",
    "instruction_id": 26,
    "annotator_id": 19,
    "language": "en-IN",
    "instruction": "Okay, now you are in a room …",
    "timed_instruction": [{"start_time": 0.4, "word": "Okay,", "end_time": 1.0}, {"word": "now"}],
    "edit_distance": 0.11,
    "instr_encoding": [0, 5, 2],
}


def rxr(**changes: Any) -> dict[str, Any]:
    return RXR | changes


def write(folder: Path, *records: dict[str, Any], name: str = "rxr_train_guide.jsonl") -> Path:
    text = "".join(f"{json.dumps(record)}\n" for record in records).encode()
    (folder / name).write_bytes(gzip.compress(text) if name.endswith(".gz") else text)
    return folder / name


def test_token_ids_are_taken_as_they_are(tmp_path: Path) -> None:
    file = tmp_path / "R2R_train_enc.json"
    file.write_text(json.dumps([ENCODED]))
    episodes = load_episodes(file, GRAPHS)
    assert [e.encoding for e in episodes] == [(101, 5, 102), (101, 9, 102)]
    assert [e.instruction for e in episodes] == R2R["instructions"]
    save_episodes(tmp_path / "again.json", episodes)
    assert load_episodes(tmp_path / "again.json", GRAPHS) == episodes


def test_room_for_room_may_come_back(tmp_path: Path) -> None:
    file = tmp_path / "R4R_train.json"
    there_and_back = R2R | {
        "path": [*PATH, "east01", "east00"],
        "shortest_path": ["east00"],
        "shortest_path_distance": 0,
        "first_path_id": 1,
        "second_path_id": 2,
    }
    file.write_text(json.dumps([there_and_back]))
    assert load_episodes(file, GRAPHS)[0].path == (*PATH, "east01", "east00")


def test_a_gzipped_file_is_read(tmp_path: Path) -> None:
    file = tmp_path / "R2R_train.json.gz"
    file.write_bytes(gzip.compress(json.dumps([R2R]).encode()))
    assert len(load_episodes(file, GRAPHS)) == 2


@pytest.mark.parametrize("name", ["rxr_train_guide.jsonl", "rxr_train_guide.jsonl.gz"])
def test_a_guide_annotation_is_an_episode(tmp_path: Path, name: str) -> None:
    (episode,) = load_episodes(write(tmp_path, RXR, name=name), GRAPHS)
    assert (episode.instruction_id, episode.path_id) == ("11_26", 11)
    assert (episode.instruction, episode.encoding) == (RXR["instruction"], (0, 5, 2))
    assert episode.heading == 3.1
    length = sum(GRAPH.distance(a, b) for a, b in zip(PATH, PATH[1:], strict=False))
    assert episode.distance == pytest.approx(length), "the sum of its edges: RxR does not give it"


def test_languages_are_selected_by_tag(tmp_path: Path) -> None:
    tags = ("en-IN", "en-US", "hi-IN", "te-IN")
    records = [rxr(instruction_id=n, language=tag) for n, tag in enumerate(tags)]
    file = write(tmp_path, *records)

    def ids(*languages: str) -> list[str]:
        return [e.instruction_id for e in load_episodes(file, GRAPHS, languages)]

    assert ids() == ["11_0", "11_1", "11_2", "11_3"]
    assert ids("en") == ["11_0", "11_1"]
    assert ids("en-US", "te") == ["11_1", "11_3"]
    with pytest.raises(InputError, match="language: expected records in e or fr, received 'en-IN,"):
        ids("e", "fr")


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        (
            {"instr_encodings": [[1]]},
            r"record 0 \(path_id 7\): instr_encodings: expected 2 lists, .* received 1",
        ),
        ({"instr_encodings": [[1], []]}, r"record 0: instr_encodings\.1"),
        ({"instr_encodings": [[1], ["a"]]}, r"record 0: instr_encodings\.1\.0"),
    ],
)
def test_bad_token_ids_are_named(tmp_path: Path, changes: dict[str, Any], expected: str) -> None:
    file = tmp_path / "bad.json"
    file.write_text(json.dumps([R2R | changes]))
    with pytest.raises(InputError, match=f"bad.json: {expected}"):
        load_episodes(file, GRAPHS)


@pytest.mark.parametrize(
    ("second", "expected"),
    [
        ({}, r"record 1 \(path_id 11\): instruction_id: expected one record, received 'two'"),
        ({"instruction_id": 2, "path": PATH[:2]}, r"record 1 .*path: expected one path"),
        ({"instruction_id": "2"}, "record 1: instruction_id: expected a valid integer"),
        ({"instruction_id": 2, "path": ["east00", "east05"]}, r"path\[1\]: .* neighbour"),
        ({"instruction_id": 2, "scan": "west"}, "scan: expected one of east, received 'west'"),
        ({"instruction_id": 2, "instr_encoding": [-1]}, r"instr_encoding\.0"),
    ],
)
def test_a_bad_guide_annotation_is_named(
    tmp_path: Path, second: dict[str, Any], expected: str
) -> None:
    with pytest.raises(InputError, match=expected):
        load_episodes(write(tmp_path, RXR, rxr(**second)), GRAPHS)


def test_many_scans_are_not_listed(tmp_path: Path) -> None:
    graphs = {f"scan{number}": GRAPH for number in range(9)}
    with pytest.raises(InputError, match="scan: expected a scan with a graph, received 'east'"):
        load_episodes(write(tmp_path, RXR), graphs)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("annotations")


@settings(max_examples=150, deadline=None)
@given(texts([R2R, ENCODED | {"path_id": 8}]), st.sampled_from(["a.json", "a.json.gz"]))
def test_no_r2r_file_ends_in_a_traceback(folder: Path, content: bytes, name: str) -> None:
    refused_or_read(folder / name, content, lambda file: load_episodes(file, GRAPHS))


@settings(max_examples=150, deadline=None)
@given(texts([RXR, rxr(instruction_id=27)], lines=True), st.sampled_from([(), ("en",)]))
def test_no_rxr_file_ends_in_a_traceback(
    folder: Path, content: bytes, languages: tuple[str, ...]
) -> None:
    file = folder / "a.jsonl"
    refused_or_read(file, content, lambda file: load_episodes(file, GRAPHS, languages))
