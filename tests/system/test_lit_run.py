"""Whole runs in a tiny lit house: rate recorded, light renewed, attacked, checked, evaluated."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from rich.progress import Progress
from typer.testing import CliRunner

from tests.houses import tiny_house
from tests.worlds import tiny_agent
from vlnhijack.agents.checkpoints import save_agent
from vlnhijack.artifacts import read_json
from vlnhijack.cli import app
from vlnhijack.errors import InputError
from vlnhijack.experiments import pictures
from vlnhijack.experiments.config import ExperimentConfig
from vlnhijack.experiments.runner import run
from vlnhijack.navigation.episode import Episode, save_episodes
from vlnhijack.rendering.fixed_illumination import FixedIlluminationRenderer
from vlnhijack.scenes.house_files import load_house, save_house

HOUSE = tiny_house("lit")
NAMES = HOUSE.graph.viewpoints
TRAIN = [(0, 1, 2), (2, 1, 0), (3, 2, 1, 0)]
TEST = [(3, 0, 1, 2)]


def episodes(paths: list[tuple[int, ...]]) -> list[Episode]:
    return [
        Episode(
            number,
            HOUSE.name,
            tuple(NAMES[viewpoint] for viewpoint in path),
            0.0,
            "walk past the chair",
            f"{number}_0",
            2.4 * (len(path) - 1),
        )
        for number, path in enumerate(paths)
    ]


@pytest.fixture
def agent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A data root with the house and an agent that has no recorded rate."""
    monkeypatch.setenv("VLNHIJACK_HOME", str(tmp_path))
    monkeypatch.setattr(pictures, "WIDTH", 32)
    monkeypatch.setattr(pictures, "HEIGHT", 24)
    folder = tmp_path / "scenes" / HOUSE.name
    save_house(HOUSE, folder)
    for split, paths in (("train", TRAIN), ("val_seen", TEST)):
        save_episodes(folder / "episodes" / f"{split}.json", episodes(paths))
    tiny = tiny_agent()
    save_agent(replace(tiny, path=tmp_path / "tiny.safetensors", metadata={}))
    yield tmp_path / "tiny.safetensors"
    torch.use_deterministic_algorithms(False)


def config(agent: Path) -> ExperimentConfig:
    picked = {
        "kind": "single_step",
        "house": str(agent.parent / "scenes" / HOUSE.name),
        "object": "cabinet_0",
        "viewpoint": NAMES[1],
    }
    return ExperimentConfig.model_validate(
        {
            "name": "lit",
            "threads": torch.get_num_threads(),
            "agent": str(agent),
            "instances": [picked],
            "rules": {"min_coverage": 0.1, "min_train": 1},
            "rendering": {
                "rung": "fixed-illumination",
                "attack_spp": 16,
                "evaluation_spp": 4,
                "refresh_every": 2,
            },
            "attack": {"iterations": 4, "checkpoint_every": 2},
        }
    )


def test_a_lit_house_is_attacked_under_renewed_light(
    agent: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    progress = Progress(disable=True)
    with pytest.raises(InputError, match=f"--house {HOUSE.name} --record"):
        run(config(agent), tmp_path / "refused", resume=False, progress=progress)
    options = ["--house", HOUSE.name, "--record", "--spp", "4"]
    done = CliRunner().invoke(app, ["agent", "eval", str(agent), *options])
    assert done.exit_code == 0, done.output
    assert read_json(agent.with_suffix(".json"))["metadata"]["val_seen_by_house"][HOUSE.name]["n"]
    renewed = []
    refresh = FixedIlluminationRenderer.refresh

    def counted(renderer: FixedIlluminationRenderer, texture: torch.Tensor) -> None:
        renewed.append(texture.detach().clone())
        refresh(renderer, texture)

    monkeypatch.setattr(FixedIlluminationRenderer, "refresh", counted)
    summary = run(config(agent), tmp_path / "run", resume=False, progress=progress)
    assert summary["single_step"]["attacked"]["n"] == len(TEST)
    assert len(renewed) >= 2 and not torch.equal(renewed[0], renewed[1])
    (attack,) = (tmp_path / "run" / "attacks").iterdir()
    assert {"map.png", "before_after.png"} <= {path.name for path in attack.iterdir()}
    attacked = load_house(attack / "house")
    assert (attacked.kind, attacked.exposure) == ("lit", HOUSE.exposure)
    change = attacked.surface("cabinet_0").texture - HOUSE.surface("cabinet_0").texture
    assert 0.005 < np.abs(change).max() <= 0.3


def test_each_rung_of_a_list_attacks_as_it_does_alone(agent: Path, tmp_path: Path) -> None:
    """Nothing but the rendering differs: same texture, same controls, same evaluation."""
    options = ["--house", HOUSE.name, "--record", "--spp", "4"]
    assert CliRunner().invoke(app, ["agent", "eval", str(agent), *options]).exit_code == 0
    renewed = config(agent)
    (fixed,) = renewed.renderings
    prb = fixed.model_copy(update={"rung": "prb", "attack_spp": 4, "refresh_every": 0})
    several = renewed.model_copy(update={"rendering": [prb, fixed]})
    progress = Progress(disable=True)
    alone = run(renewed, tmp_path / "alone", resume=False, progress=progress)
    together = run(several, tmp_path / "together", resume=False, progress=progress)
    assert list(together["single_step"]) == ["clean", "noise", prb.name, fixed.name]
    for arm, same in (("clean", "clean"), ("noise", "noise"), ("attacked", fixed.name)):
        assert alone["single_step"][arm] == together["single_step"][same]
    (name,) = alone["attacks"]
    loss = {key: row["loss_own_rays"] for key, row in together["attacks"].items()}
    assert loss[f"{name}-{fixed.name}"] == alone["attacks"][name]["loss_own_rays"]
    assert loss[f"{name}-{prb.name}"] is None, "other rays in every iteration"
    first, second = (
        load_house(tmp_path / where / "house").surface("cabinet_0").texture
        for where in (f"alone/attacks/{name}", f"together/attacks/{name}-{fixed.name}")
    )
    np.testing.assert_array_equal(first, second)
