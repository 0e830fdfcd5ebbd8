"""Houses given by path: their own episodes, rates and files, whatever the folder is called."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import torch
from rich.progress import Progress

from tests.houses import tiny_house
from tests.worlds import tiny_agent
from vlnhijack.agents.checkpoints import read_description, record_metadata, save_agent
from vlnhijack.errors import InputError
from vlnhijack.experiments import agent_eval
from vlnhijack.experiments.agent_eval import Rendering, evaluate_in_houses
from vlnhijack.experiments.baseline import made_by
from vlnhijack.experiments.config import ExperimentConfig
from vlnhijack.experiments.context import Context, load_context
from vlnhijack.navigation.episode import Episode, save_episodes
from vlnhijack.scenes.house_files import save_house

HOUSE = tiny_house()
NAME, PROGRESS = HOUSE.name, Progress(disable=True)


def _save(folder: Path, count: int) -> None:
    """The house with so many episodes of each split."""
    save_house(HOUSE, folder)
    path = HOUSE.graph.viewpoints[:2]
    for split in ("train", "val_seen"):
        episodes = [
            Episode(number, NAME, path, 0.0, "walk past the chair", f"{number}_0", 2.4)
            for number in range(count)
        ]
        save_episodes(folder / "episodes" / f"{split}.json", episodes)


@pytest.fixture
def mine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A house with two episodes; that of its name in the data root has three."""
    monkeypatch.setenv("VLNHIJACK_HOME", str(tmp_path))
    _save(tmp_path / "scenes" / NAME, 3)
    _save(tmp_path / "mine", 2)
    rates = {"val_seen_by_house": {NAME: {"sr": 0.0}}}
    save_agent(replace(tiny_agent(), path=tmp_path / "tiny.safetensors", metadata=rates))
    return tmp_path / "mine"


def _context(mine: Path, *houses: Path | str) -> Context:
    wanted = [
        {"kind": "single_step", "house": str(house), "object": "table_0", "viewpoint": "v"}
        for house in houses
    ]
    settings = {"name": "a", "agent": str(mine.parent / "tiny.safetensors"), "instances": wanted}
    return load_context(ExperimentConfig.model_validate(settings), mine.parent / "run", PROGRESS)


def test_a_house_given_by_path_has_its_own_episodes(mine: Path) -> None:
    context = _context(mine, mine)
    assert list(context.houses) == list(context.scans) == [NAME]
    assert len(context.scan_of(str(mine)).val_seen) == len(context.scans[NAME].train) == 2
    assert len(_context(mine, NAME).scan_of(NAME).val_seen) == 3


def test_two_houses_of_one_name_are_refused(mine: Path) -> None:
    assert list(_context(mine, mine, mine.parent / "scenes" / ".." / "mine").houses) == [NAME]
    with pytest.raises(InputError, match="house: expected houses of different names, received"):
        _context(mine, mine, NAME)


def test_a_missing_rate_is_to_be_recorded_in_that_folder(mine: Path) -> None:
    record_metadata(mine.parent / "tiny.safetensors", {"val_seen_by_house": {}})
    with pytest.raises(InputError, match=f"--house {mine} --record"):
        _context(mine, mine)
    with pytest.raises(InputError, match=f"--house {NAME} --record"):
        _context(mine, NAME)


@pytest.mark.parametrize("file", ["house.json", f"{NAME}_connectivity.json"])
def test_clean_views_hang_on_every_file_and_the_size(mine: Path, file: str) -> None:
    before = _context(mine, mine)
    known = made_by(before, NAME, 16, 0)
    assert known == made_by(_context(mine, mine), NAME, 16, 0)
    assert "12 × 8, llvm_ad_rgb" in known
    (mine / file).write_text((mine / file).read_text() + "\n")
    after = _context(mine, mine)
    assert made_by(after, NAME, 16, 0) != known
    changed = after.inputs[NAME].items() ^ before.inputs[NAME].items()
    assert {name for name, _ in changed} == {f"{NAME}/{file}"}


def test_rates_are_recorded_beside_those_recorded_meanwhile(
    mine: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    weights = mine.parent / "tiny.safetensors"

    def measured(*given: Any) -> dict[str, float]:
        record_metadata(weights, {"val_seen_by_house": {"birch": {"sr": 0.5}}})
        return {"sr": 0.25, "n": len(given[-1])}

    monkeypatch.setattr(agent_eval, "_encode", lambda *given: torch.zeros(4, 36, 8))
    monkeypatch.setattr(agent_eval, "rates", measured)
    evaluate_in_houses(str(weights), [str(mine)], Rendering(16, 1), True, PROGRESS)
    known = read_description(weights).metadata["val_seen_by_house"]
    assert known == {"birch": {"sr": 0.5}, NAME: {"sr": 0.25, "n": 2}}
