"""`.house` files, whole and broken."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.fuzz import refused_or_read
from vlnhijack.errors import InputError
from vlnhijack.scenes.matterport.house_file import Category, read_house_file

TEXT = """ASCII 1.1
H  scan  -  0 1 0 0 2 2 2 1 0  1  0 0 0 0 0 0 0 0  5 5 2.5  0 0 0 0 0
L  0  1  -  0 0 0  0 0 0  5 5 2.5  0 0 0 0 0
R  0 0  0 0  k  2.5 2.5 1  0 0 0  5 5 2.5  2.5  0 0 0 0
P  aa  0 0  0  1 1 1.5  0 0 0 0 0
C  0  28 kitchen#cabinet  7 cabinet  0 0 0 0 0
C  1  1 wall  1 wall  0 0 0 0 0
O  0 0 0  1 1 0.5  1 0 0  0 1 0  0.5 0.5 0.5  0 0 0 0 0 0 0 0
O  1 -1 -1  2 2 1  1 0 0  0 1 0  2 2 1  0 0 0 0 0 0 0 0
E  0 0 17  1  1 1 0.5  0 0 0  1 1 1  0 0 0 0 0
E  1 1 4  1  1 1 0.5  0 0 0  1 1 1  0 0 0 0 0
"""


def test_everything_is_read(tmp_path: Path) -> None:
    file = tmp_path / "scan.house"
    file.write_text(TEXT)
    house = read_house_file(file)
    assert house.name == "scan"
    assert [r.code for r in house.regions] == ["k"]
    assert house.regions[0].bounds == (0, 0, 0, 5, 5, 2.5)
    assert house.category(0) == Category("kitchen cabinet", "cabinet")
    assert house.category(1).mpcat40 == "unlabeled"
    assert house.objects[0].centre == (1, 1, 0.5)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("ASCII 1.1", "ASCII 2", "line 1: expected ASCII 1.1"),
        ("E  1 1 4", "X", "line 2: H: number of E lines: expected 1, received 2"),
        ("O  0 0 0", "O  0 1 0", "line 8: O: region: expected an index below 1"),
        ("O  1 -1", "O  5 -1", "line 9: O: index: expected 1, received 5"),
        ("1 1 0.5  1 0 0", "1 nan 0.5  1 0 0", "line 8: O: position: expected finite numbers"),
        ("C  1  1 wall  1 wall", "X", "line 2: H: number of C lines: expected 1, received 2"),
        ("O  0 0 0  1 1", "O 0 x 0 1 1", "line 8: O: region: expected an integer, received 'x'"),
        ("C  1  1 wall  1 wall  0 0 0 0 0", "C  1", "line 7: C: words: expected ≥ 6, received 2"),
    ],
)
def test_a_bad_line_is_named(tmp_path: Path, old: str, new: str, expected: str) -> None:
    (tmp_path / "scan.house").write_text(TEXT.replace(old, new))
    with pytest.raises(InputError, match=rf"scan\.house: {expected}"):
        read_house_file(tmp_path / "scan.house")


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("house") / "scan.house"


@settings(max_examples=150, deadline=None)
@given(st.binary(max_size=12), st.integers(0, len(TEXT)), st.booleans())
def test_no_file_ends_in_a_traceback(file: Path, junk: bytes, at: int, cut: bool) -> None:
    content = TEXT.encode()
    rest = b"" if cut else content[at + len(junk) :]
    refused_or_read(file, content[:at] + junk + rest, read_house_file)
