"""JSON lists, objects and lines, read piece by piece."""

import gzip
import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.fuzz import VALUES, refused_or_read, texts
from vlnhijack import artifacts
from vlnhijack.artifacts import (
    read_json,
    stream_json_lines,
    stream_json_list,
    stream_json_object,
)
from vlnhijack.errors import InputError

LISTS = st.lists(VALUES, max_size=6)


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("json") / "list.json"


@settings(max_examples=80, deadline=None)
@given(LISTS, st.integers(1, 30), st.sampled_from([None, 0, 2]))
def test_a_list_is_the_same_whatever_the_pieces(
    file: Path, values: list[Any], chunk: int, indent: int | None
) -> None:
    file.write_text(json.dumps(values, indent=indent))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(artifacts, "_CHUNK", chunk)
        assert repr(list(stream_json_list(file))) == repr(json.loads(file.read_text()))
        named = {str(number): value for number, value in enumerate(values)}
        file.write_text(json.dumps(named, indent=indent))
        assert repr(dict(stream_json_object(file))) == repr(json.loads(file.read_text()))


@settings(max_examples=80, deadline=None)
@given(texts([1, "two", {"three": [4, 5]}]), st.integers(1, 30))
def test_any_other_file_is_refused_in_one_line(file: Path, content: bytes, chunk: int) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(artifacts, "_CHUNK", chunk)
        patch.setattr(artifacts, "_LONGEST_ITEM", 200)
        refused_or_read(file, content, lambda path: list(stream_json_list(path)))
        refused_or_read(file, content, lambda path: list(stream_json_object(path)))
        refused_or_read(file, content, lambda path: list(stream_json_lines(path)))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "expected a JSON list with .* received 'the end of the file'"),
        ('{"a": 1}', "expected a JSON list"),
        ("[1, 2", "record 2: expected a JSON list with , or ]"),
        ("[1, 2]]", "nothing after the list"),
        ("[1 2]", "record 1: expected .* received '2'"),
        ("[1, {]", "record 1: not valid JSON"),
    ],
)
def test_what_is_wrong_with_a_list_is_said(file: Path, text: str, expected: str) -> None:
    file.write_text(text)
    with pytest.raises(InputError, match=expected):
        list(stream_json_list(file))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("[1]", "expected a JSON object with { here"),
        ("{1: 2}", "expected a text that is no key yet, received 1"),
        ('{"a" 2}', "a: expected a JSON object with : here"),
        ('{"a": 1, "a": 2}', "a: expected a text that is no key yet, received 'a'"),
        ('{"a": {"b": 1, "b": 2}}', "a: expected each key once, received 'b'"),
        ('{"a": 1', "a: expected a JSON object with , or }"),
    ],
)
def test_what_is_wrong_with_an_object_is_said(file: Path, text: str, expected: str) -> None:
    file.write_text(text)
    with pytest.raises(InputError, match=expected):
        list(stream_json_object(file))


def test_only_a_piece_is_read_for_the_first_item(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(artifacts, "_CHUNK", 16)
    file.write_text("[" + ",".join(["1"] * 100) + ", broken]")
    items = stream_json_list(file)
    assert next(items) == 1
    with pytest.raises(InputError, match="not valid JSON"):
        list(items)


def test_gzipped_files_read_the_same(tmp_path: Path) -> None:
    packed = tmp_path / "list.json.gz"
    packed.write_bytes(gzip.compress(b'[{"a": 1}]'))
    assert read_json(packed) == list(stream_json_list(packed)) == [{"a": 1}]
    packed.write_bytes(packed.read_bytes()[:-4])
    with pytest.raises(InputError, match="not a readable text file"):
        read_json(packed)
    with pytest.raises(InputError, match="no such file"):
        read_json(tmp_path / "none.json")
