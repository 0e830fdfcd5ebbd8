"""Run folders: when an experiment may write into one."""

from pathlib import Path

import pytest

from vlnhijack.artifacts import read_json
from vlnhijack.errors import InputError
from vlnhijack.experiments.config import DatasetInstances, DrawnInstances, ExperimentConfig
from vlnhijack.experiments.instances.files import save_instances
from vlnhijack.experiments.runner import keep_start, open_folder, stored_instances
from vlnhijack.experiments.yaml_config import load_config
from vlnhijack.navigation.episode import Episode
from vlnhijack.threat import AttackInstance

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


INPUTS = {"alder": {"small.safetensors": "0a", "alder/house.json": "0b"}}


def _instance(test: tuple[str, ...]) -> AttackInstance:
    episodes = tuple(Episode(1, "alder", test, 0.5, "walk on", "1_0", 2.0) for _ in range(2))
    return AttackInstance("a", "alder", "sofa_0", "sofa", "v", 0.1, (), (), (), episodes)


def test_a_run_goes_on_with_what_it_began_with(tmp_path: Path) -> None:
    keep_start(tmp_path, [_instance(("v", "w"))], INPUTS)
    keep_start(tmp_path, [_instance(("v", "w"))], INPUTS)
    kept = (tmp_path / "instances.json").read_bytes()
    with pytest.raises(InputError, match=r"instances\.json: other instances than the run began wi"):
        keep_start(tmp_path, [_instance(("v", "u"))], INPUTS)
    assert (tmp_path / "instances.json").read_bytes() == kept


@pytest.mark.parametrize("file", INPUTS["alder"])
def test_a_run_does_not_go_on_with_other_files(tmp_path: Path, file: str) -> None:
    keep_start(tmp_path, [], INPUTS)
    with pytest.raises(InputError, match=rf"inputs\.json: changed since the run began: {file}$"):
        keep_start(tmp_path, [], {"alder": INPUTS["alder"] | {file: "0c"}})


def test_stored_attacks_lie_in_houses_of_their_name(tmp_path: Path) -> None:
    save_instances(tmp_path / "i.parquet", [_instance(("v", "w"))], DatasetInstances())
    file = tmp_path / "i.json"
    assert [each.scan for each in stored_instances(file, ["alder"])] == ["alder"]
    with pytest.raises(InputError, match=r"i\.json: scan: expected the name of a house \(birch\)"):
        stored_instances(file, ["birch"])


@pytest.mark.parametrize("resume", [False, True])
def test_a_folder_with_other_files_is_left_alone(tmp_path: Path, resume: bool) -> None:
    (tmp_path / "thesis.tex").write_text("precious")
    with pytest.raises(InputError, match=r"expected an empty or new folder"):
        open_folder(CONFIG, tmp_path, resume=resume)
    assert [file.name for file in tmp_path.iterdir()] == ["thesis.tex"]
