from pathlib import Path

import pytest

from vlnhijack.errors import InputError
from vlnhijack.experiments.config import DrawnInstances, ExperimentConfig, PickedInstance
from vlnhijack.experiments.train_agent import AgentConfig
from vlnhijack.experiments.yaml_config import load_config, save_config

DRAWN = """
name: sample
instances: {kind: single_step, houses: [alder], count: 3}
attack: {iterations: 20}
"""
PICKED = """
name: quick
instances:
- {kind: trajectory, house: alder, object: sofa_0, viewpoint: a, target: b}
"""

SEVERAL = """
rendering:
- {attack_spp: 4, evaluation_spp: 4}
- {rung: fixed-illumination, evaluation_spp: 4, refresh_every: 10}
"""


def write(folder: Path, text: str) -> Path:
    file = folder / "a.yaml"
    file.write_text(text)
    return file


def message(file: Path, *overrides: str) -> str:
    """The error of loading the file: one line that names it."""
    with pytest.raises(InputError) as caught:
        load_config(file, ExperimentConfig, overrides)
    text = str(caught.value)
    assert "\n" not in text
    return text.replace(str(file.parent) + "/", "")


def test_what_is_not_said_has_the_papers_value(tmp_path: Path) -> None:
    config = load_config(write(tmp_path, DRAWN), ExperimentConfig)
    assert config.instances == DrawnInstances(kind="single_step", houses=["alder"], count=3)
    assert config.attack.iterations == 20
    assert (config.attack.batch, config.attack.epsilon, config.attack.lr) == (16, 0.3, 0.01)
    picked = load_config(write(tmp_path, PICKED), ExperimentConfig).instances
    assert isinstance(picked, list)
    assert picked[0] == PickedInstance(
        kind="trajectory", house="alder", object="sofa_0", viewpoint="a", target="b"
    )


@pytest.mark.parametrize("text", [DRAWN, PICKED, DRAWN + SEVERAL])
def test_a_saved_config_is_the_same(tmp_path: Path, text: str) -> None:
    config = load_config(write(tmp_path, text), ExperimentConfig)
    save_config(tmp_path / "saved.yaml", config)
    assert load_config(tmp_path / "saved.yaml", ExperimentConfig) == config


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("sede: 1", "a.yaml: sede: expected no such key, received 1"),
        ("rendering: {sp: 2}", "a.yaml: rendering.sp: expected no such key, received 2"),
        ("seed: one", "a.yaml: seed: expected a valid integer"),
        ("threads: 0", "a.yaml: threads: expected greater than 0, received 0"),
        ("rendering: {attack_spp: 3}", "a.yaml: rendering.attack_spp: expected a square number, r"),
        ("rendering: 3", "a.yaml: rendering: expected a valid dictionary"),
        ("rules: {min_paths: 1}", "a.yaml: rules.min_paths: expected greater than or equal to 2"),
        ("rules: {validation: 0}", "a.yaml: rules.validation: expected greater than 0, received 0"),
        ("rules: {target_distance: .inf}", "a.yaml: rules.target_distance: expected a finite n"),
        ("rules: {validation: .nan}", "a.yaml: rules.validation: expected a finite number"),
        ("rendering: {max_memory: .inf}", "a.yaml: rendering.max_memory: expected a finite numb"),
        ("rendering: {rung: maya}", "a.yaml: rendering.rung: expected 'frozen', 'fixed-"),
    ],
)
def test_bad_values_are_named(tmp_path: Path, line: str, expected: str) -> None:
    assert message(write(tmp_path, f"{DRAWN}\n{line}")).startswith(expected)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("name: [a", "a.yaml: not valid YAML (while parsing a flow sequence"),
        ("- a\n- b", "a.yaml: expected keys and values, received 'list'"),
        ("", "a.yaml: expected keys and values, received 'NoneType'"),
        ("name: a", "a.yaml: instances: expected a value, received 'nothing'"),
    ],
)
def test_bad_files_are_named(tmp_path: Path, text: str, expected: str) -> None:
    assert message(write(tmp_path, text)).startswith(expected)


def test_a_file_that_is_no_text_is_named(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_bytes(b"\xff\xfe\x00")
    assert message(tmp_path / "a.yaml").startswith("a.yaml: not valid YAML")
    (tmp_path / "a.yaml").unlink()
    assert message(tmp_path / "a.yaml") == "a.yaml: expected a YAML file, received 'no such file'"


@pytest.mark.parametrize(
    ("old", "new", "field"),
    [
        ("count: 3", "count: 0", "count: expected greater than 0, received 0"),
        ("count: 3", "cuont: 3", "count: expected a value, received 'nothing'"),
        ("houses: [alder]", "houses: alder", "houses: expected a valid list"),
    ],
)
def test_errors_in_drawn_instances_name_their_key(
    tmp_path: Path, old: str, new: str, field: str
) -> None:
    found = message(write(tmp_path, DRAWN.replace(old, new)))
    assert found.startswith(f"a.yaml: instances.{field}")


@pytest.mark.parametrize(
    ("rendering", "expected"),
    [
        ("{refresh_every: 5}", "a.yaml: rendering.refresh_every needs rendering.rung: fixed-"),
        (
            "{rung: fixed-illumination, refresh_every: 7}",
            "a.yaml: attack.checkpoint_every (30) must be a multiple of rendering.refresh_every (7",
        ),
    ],
)
def test_light_is_renewed_by_the_rung_that_has_it_and_at_checkpoints(
    tmp_path: Path, rendering: str, expected: str
) -> None:
    assert message(write(tmp_path, f"{DRAWN}\nrendering: {rendering}")).startswith(expected)


def test_several_renderings_have_names_of_their_own(tmp_path: Path) -> None:
    config = load_config(write(tmp_path, DRAWN + SEVERAL), ExperimentConfig)
    names = [rendering.name for rendering in config.renderings]
    assert names == ["frozen_4spp", "fixed-illumination_16spp_refresh10"]
    assert config.evaluation_spp == 4


@pytest.mark.parametrize(
    ("rendering", "expected"),
    [
        ("[]", "a.yaml: rendering: expected a valid"),
        ("[{}, {attack_spp: 3}]", "a.yaml: rendering.1.attack_spp: expected a square number, r"),
        ("[{}, {max_memory: 99}]", "a.yaml: rendering: each rung, attack_spp and refresh_every on"),
        ("[{}, {rung: prb, evaluation_spp: 4}]", "a.yaml: rendering.evaluation_spp must be the s"),
        ("[{}, {attack_spp: 4, refresh_every: 9}]", "a.yaml: rendering.refresh_every needs rend"),
    ],
)
def test_renderings_that_cannot_be_compared_are_refused(
    tmp_path: Path, rendering: str, expected: str
) -> None:
    assert message(write(tmp_path, f"{DRAWN}\nrendering: {rendering}")).startswith(expected)


def test_errors_in_picked_instances_name_their_key(tmp_path: Path) -> None:
    text = PICKED.replace("object: sofa_0", "objekt: sofa_0")
    found = message(write(tmp_path, text))
    assert found == "a.yaml: instances.0.object: expected a value, received 'nothing'"


def test_a_single_step_attack_has_no_target(tmp_path: Path) -> None:
    found = message(write(tmp_path, PICKED.replace("trajectory", "single_step")))
    assert found.startswith("a.yaml: instances.0.target: expected no target")


def test_a_place_is_picked_once(tmp_path: Path) -> None:
    twice = PICKED + PICKED.strip().splitlines()[-1].replace("target: b", "target: c")
    found = message(write(tmp_path, twice))
    assert found.startswith("a.yaml: instances: expected each kind, house, object and viewpoint")


def test_overrides_replace_single_values(tmp_path: Path) -> None:
    file = write(tmp_path, DRAWN)
    overrides = ["attack.batch=4", "instances.count=7", "rendering.rung=prb"]
    config = load_config(file, ExperimentConfig, overrides)
    assert (config.attack.iterations, config.attack.batch) == (20, 4)
    assert isinstance(config.instances, DrawnInstances)
    assert config.instances.count == 7
    assert config.rendering.rung == "prb"
    assert "seed" in message(file, "seed=x")


@pytest.mark.parametrize(
    ("override", "expected"),
    [
        ("seed", "--set: expected key=value, received 'seed'"),
        ("=3", "--set: expected key=value, received '=3'"),
        ("name.first=3", "--set: expected keys of nested settings, received 'name.first'"),
        ("seed=[", "--set seed: expected a YAML value, received '['"),
        ("attack.speed=3", "a.yaml: attack.speed: expected no such key, received 3"),
        ("attack.betas=[0.9, 1]", "a.yaml: attack.betas.1: expected less than 1, received 1"),
        ("attack.lr=.inf", "a.yaml: attack.lr: expected a finite number, received inf"),
    ],
)
def test_bad_overrides_are_named(tmp_path: Path, override: str, expected: str) -> None:
    assert message(write(tmp_path, DRAWN), override) == expected


def test_nested_schedules_of_an_agent_are_checked_too(tmp_path: Path) -> None:
    text = Path("experiments/small_agent.yaml").read_text()
    file = write(tmp_path, text.replace("epochs:", "epoch:"))
    with pytest.raises(InputError, match=r"a\.yaml: encoder\.epoch: expected no such key"):
        load_config(file, AgentConfig)
