import errno
from collections.abc import Callable
from pathlib import Path

import pytest

from vlnhijack.artifacts import (
    append_row,
    atomic_folder,
    atomic_path,
    read_rows,
    require_replaceable,
    write_json,
)
from vlnhijack.errors import InputError

FULL = "No space left on device"


def fill(_: Path) -> None:
    raise OSError(errno.ENOSPC, FULL)


@pytest.mark.parametrize("atomic", [atomic_path, atomic_folder])
def test_a_full_disk_is_named_and_leaves_the_old_one(tmp_path: Path, atomic: Callable) -> None:
    place = tmp_path / "kept"
    with atomic(place) as new:
        (new / "a" if new.is_dir() else new).write_text("old")
    before = {path: path.is_dir() or path.read_text() for path in tmp_path.rglob("*")}
    with pytest.raises(OSError, match=FULL) as caught, atomic(place) as new:
        fill(new)
    assert caught.value.filename == str(place)
    assert {path: path.is_dir() or path.read_text() for path in tmp_path.rglob("*")} == before


def test_only_folders_of_the_kind_are_replaced(tmp_path: Path) -> None:
    folder = tmp_path / "out"
    require_replaceable(folder, "house.json")
    folder.mkdir()
    require_replaceable(folder, "house.json")
    (folder / "thesis.tex").write_text("years of work")
    for place in (folder, folder / "thesis.tex"):
        with pytest.raises(InputError, match="or one with house.json, received 'other files'"):
            require_replaceable(place, "house.json")
    (folder / "house.json").write_text("{}")
    require_replaceable(folder, "house.json")


def test_writing_to_a_full_device_names_the_file() -> None:
    full = Path("/dev/full")
    if not full.exists():
        pytest.skip("no /dev/full on this system")
    with pytest.raises(OSError, match=FULL) as caught:
        append_row(full, {"a": 1})
    assert caught.value.filename == str(full)


def test_rows_survive_a_line_cut_off(tmp_path: Path) -> None:
    file = tmp_path / "rows.jsonl"
    append_row(file, {"a": 1})
    append_row(file, {"a": 2})
    with file.open("a") as rows:
        rows.write('{"a": ')
    assert read_rows(file) == [{"a": 1}, {"a": 2}]


def test_json_replaces_the_whole_file(tmp_path: Path) -> None:
    file = tmp_path / "deep" / "a.json"
    write_json(file, [1] * 1000)
    write_json(file, {"b": "é"})
    assert file.read_text() == '{\n "b": "é"\n}\n'
    assert [path.name for path in file.parent.iterdir()] == ["a.json"]
