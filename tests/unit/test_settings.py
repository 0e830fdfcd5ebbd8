from pathlib import Path

import pytest

from vlnhijack import settings
from vlnhijack.errors import InputError, SetupError


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in ("villa", "attic"):
        (tmp_path / "scenes" / name).mkdir(parents=True)
        (tmp_path / "scenes" / name / settings.SCENE_FILE).touch()
    (tmp_path / "scenes" / "notes").mkdir()
    monkeypatch.setenv("VLNHIJACK_HOME", str(tmp_path))
    return tmp_path


def test_home_decides(home: Path) -> None:
    assert settings.scenes_folder() == home.resolve() / "scenes"
    assert settings.experiments_folder() == home.resolve() / "experiments"
    assert settings.house_names() == ["attic", "villa"]


def test_clone_is_the_default(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("VLNHIJACK_HOME", raising=False)
    assert settings.data_root() == Path(__file__).resolve().parents[2]


def test_no_clone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("VLNHIJACK_HOME", raising=False)
    monkeypatch.setattr(settings, "PACKAGE", tmp_path / "site-packages" / "vlnhijack")
    with pytest.raises(SetupError, match="set VLNHIJACK_HOME"):
        settings.data_root()


def test_home_that_is_no_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("VLNHIJACK_HOME", str(tmp_path / "gone"))
    with pytest.raises(InputError, match=r"VLNHIJACK_HOME: expected an existing folder"):
        settings.data_root()


def test_house_by_name_and_by_path(home: Path) -> None:
    villa = home.resolve() / "scenes" / "villa"
    assert settings.house_folder("villa") == villa
    assert settings.house_folder(villa) == villa


@pytest.mark.parametrize("name", ["cellar", "notes"])
def test_unknown_house_lists_the_known(home: Path, name: str) -> None:
    with pytest.raises(InputError, match=rf"\(attic, villa\), received '{name}'"):
        settings.house_folder(name)
