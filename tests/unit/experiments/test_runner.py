"""Run folders: when an experiment may write into one."""

from pathlib import Path

import pytest

from vlnhijack.artifacts import read_json
from vlnhijack.errors import InputError
from vlnhijack.experiments.config import DrawnInstances, ExperimentConfig
from vlnhijack.experiments.runner import open_folder
from vlnhijack.experiments.yaml_config import load_config

CONFIG = ExperimentConfig(
    name="sample",
    seed=5,
    instances=DrawnInstances(kind="single_step", houses=["alder"], count=2),
)


@pytest.mark.parametrize("exists", [False, True])
def test_a_new_run_writes_its_settings_and_versions(tmp_path: Path, exists: bool) -> None:
    folder = tmp_path / "runs" / "sample"
    if exists:
        folder.mkdir(parents=True)
    open_folder(CONFIG, folder, resume=False)
    assert load_config(folder / "config.yaml", ExperimentConfig) == CONFIG
    environment = read_json(folder / "environment.json")
    assert (environment["seed"], environment["threads"]) == (5, 2)
    assert environment["packages"]["torch"].startswith("2.")


def test_the_same_run_is_continued_only_when_asked(tmp_path: Path) -> None:
    open_folder(CONFIG, tmp_path / "a", resume=False)
    written = (tmp_path / "a" / "config.yaml").stat().st_mtime_ns
    open_folder(CONFIG, tmp_path / "a", resume=True)
    assert (tmp_path / "a" / "config.yaml").stat().st_mtime_ns == written
    with pytest.raises(InputError, match=r"a: expected no earlier run \(or --resume\)"):
        open_folder(CONFIG, tmp_path / "a", resume=False)


def test_resuming_nothing_starts_anew(tmp_path: Path) -> None:
    open_folder(CONFIG, tmp_path / "a", resume=True)
    assert (tmp_path / "a" / "config.yaml").exists()


def test_a_run_with_other_settings_is_not_continued(tmp_path: Path) -> None:
    open_folder(CONFIG, tmp_path / "a", resume=False)
    changed = CONFIG.model_copy(update={"seed": 6})
    with pytest.raises(InputError, match=r"config\.yaml: seed: expected 5, received 6"):
        open_folder(changed, tmp_path / "a", resume=True)


@pytest.mark.parametrize("resume", [False, True])
def test_a_folder_with_other_files_is_left_alone(tmp_path: Path, resume: bool) -> None:
    (tmp_path / "thesis.tex").write_text("precious")
    with pytest.raises(InputError, match=r"expected an empty or new folder"):
        open_folder(CONFIG, tmp_path, resume=resume)
    assert [file.name for file in tmp_path.iterdir()] == ["thesis.tex"]
