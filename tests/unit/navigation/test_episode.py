import json
from pathlib import Path
from typing import Any

import pytest

from tests.houses import tiny_house
from vlnhijack.errors import InputError
from vlnhijack.navigation.episode import Episode, load_episodes, save_episodes

GRAPH = tiny_house().graph
A, B, C, D = GRAPH.viewpoints
GRAPHS = {GRAPH.scan: GRAPH}


def record(**changes: Any) -> dict[str, Any]:
    good = {
        "distance": 4.8,
        "scan": GRAPH.scan,
        "path_id": 7,
        "path": [A, B, C],
        "heading": 1.25,
        "instructions": ["Go past the cabinet.", "Stop by the table.", "Walk on."],
    }
    return good | changes


def write(file: Path, *records: dict[str, Any]) -> Path:
    file.write_text(json.dumps(records))
    return file


def test_a_record_becomes_one_episode_per_instruction(tmp_path: Path) -> None:
    episodes = load_episodes(write(tmp_path / "train.json", record()), GRAPHS)
    assert [e.instruction_id for e in episodes] == ["7_0", "7_1", "7_2"]
    assert episodes[1] == Episode(7, GRAPH.scan, (A, B, C), 1.25, "Stop by the table.", "7_1", 4.8)


def test_saved_episodes_load_again(tmp_path: Path) -> None:
    episodes = load_episodes(write(tmp_path / "a.json", record(), record(path_id=8)), GRAPHS)
    save_episodes(tmp_path / "b.json", episodes)
    assert load_episodes(tmp_path / "b.json", GRAPHS) == episodes


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"path": [A, "nowhere"]}, r" \(path_id 7\): path\[1\]: .*nowhere"),
        ({"path": [A, C]}, r"path\[1\]: expected a neighbour"),
        ({"path": []}, "path"),
        ({"path": A}, "path"),
        ({"path_id": "7"}, "path_id"),
        ({"path_id": True}, "path_id"),
        ({"scan": "elsewhere"}, "scan: expected one of tiny_baked"),
        ({"heading": "north"}, "heading"),
        ({"heading": float("nan")}, "heading"),
        ({"distance": -1.0}, "distance"),
        ({"instructions": []}, "instructions"),
        ({"instructions": ["go", "  "]}, "instructions.1"),
    ],
)
def test_bad_records_are_named(tmp_path: Path, changes: dict[str, Any], field: str) -> None:
    with pytest.raises(InputError, match=rf"bad\.json: record 0.*{field}"):
        load_episodes(write(tmp_path / "bad.json", record(**changes)), GRAPHS)


def test_a_missing_field_is_named(tmp_path: Path) -> None:
    incomplete = record()
    del incomplete["heading"]
    with pytest.raises(InputError, match=r"record 1: heading"):
        load_episodes(write(tmp_path / "bad.json", record(), incomplete), GRAPHS)


def test_a_path_id_twice_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"record 1 \(path_id 7\)"):
        load_episodes(write(tmp_path / "bad.json", record(), record()), GRAPHS)


def test_a_file_that_is_no_list_is_refused(tmp_path: Path) -> None:
    (tmp_path / "bad.json").write_text('{"scan": "x"}')
    with pytest.raises(InputError, match=r"bad\.json"):
        load_episodes(tmp_path / "bad.json", GRAPHS)
