from pathlib import Path

import pytest
from rich.progress import Progress

from vlnhijack.errors import InputError
from vlnhijack.experiments.make_house import make_house_folder


def test_a_bad_name_is_refused_before_any_work(tmp_path: Path) -> None:
    progress = Progress(disable=True)
    with pytest.raises(InputError, match="name: expected letters, digits, _ and -"):
        make_house_folder(
            "a b", 1, tmp_path / "a", lit=True, spp=1, unseen=False, progress=progress
        )
    assert not progress.tasks
    assert not list(tmp_path.iterdir())


def test_other_files_are_kept_before_any_work(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("kept")
    progress = Progress(disable=True)
    with pytest.raises(InputError, match="other files"):
        make_house_folder("a", 1, tmp_path, lit=True, spp=1, unseen=False, progress=progress)
    assert not progress.tasks
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]
