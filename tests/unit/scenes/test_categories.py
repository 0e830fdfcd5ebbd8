"""Matterport3D's category table."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.fuzz import refused_or_read
from vlnhijack.errors import InputError
from vlnhijack.scenes.categories import read_categories

ROWS = [["index", "raw_category", "mpcat40"], ["1", "couch", "sofa"], ["2", "tv stand", "table"]]


def text(separator: str) -> str:
    return "".join(separator.join(row) + "\n" for row in ROWS)


@pytest.mark.parametrize("separator", ["\t", "    "])
def test_raw_categories_have_a_meaning(tmp_path: Path, separator: str) -> None:
    (tmp_path / "table.tsv").write_text(text(separator))
    assert read_categories(tmp_path / "table.tsv") == {"couch": "sofa", "tv stand": "table"}


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ("index\traw_category\n1\tcouch\n", "line 1: expected a column mpcat40"),
        (text("\t") + "3\tsofa\n", "line 4: expected 3 columns, received 2"),
        (text("\t") + "3\tcouch\tchair\n", "line 4: mpcat40: expected the one category of"),
        (text("\t") + "3\tcouch\t\n", "line 4: mpcat40"),
    ],
)
def test_a_bad_line_is_named(tmp_path: Path, content: str, expected: str) -> None:
    (tmp_path / "table.tsv").write_text(content)
    with pytest.raises(InputError, match=rf"table\.tsv: {expected}"):
        read_categories(tmp_path / "table.tsv")


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("categories") / "table.tsv"


@settings(max_examples=100, deadline=None)
@given(st.binary(max_size=30), st.integers(0, 60), st.sampled_from(["\t", "    "]))
def test_no_table_ends_in_a_traceback(file: Path, junk: bytes, at: int, separator: str) -> None:
    whole = text(separator).encode()
    refused_or_read(file, whole[:at] + junk + whole[at:], read_categories)
    refused_or_read(file, whole[:at] + junk, read_categories)
