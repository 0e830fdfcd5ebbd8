"""Whole runs on a shipped house with the shipped agent: repeated, killed, resumed, refused."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from vlnhijack.scenes.exr import read_exr
from vlnhijack.settings import experiments_folder

SHORT = ("attack.iterations=6", "attack.checkpoint_every=2", "rendering.evaluation_spp=4")
LAST = 6


def command(out: Path, *options: str) -> list[str]:
    sets = [part for setting in SHORT for part in ("--set", setting)]
    quickstart = str(experiments_folder() / "quickstart.yaml")
    code = "from vlnhijack.cli import main; main()"
    return [sys.executable, "-c", code, "run", quickstart, "--out", str(out), *sets, *options]


def run(out: Path, *options: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command(out, *options), capture_output=True, text=True, check=False)


def textures(out: Path) -> dict[str, np.ndarray]:
    found = sorted(out.glob(f"attacks/*/checkpoints/{LAST:05d}.exr"))
    return {path.parent.parent.name: read_exr(path) for path in found}


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("runs") / "whole"
    done = run(out)
    assert done.returncode == 0, done.stderr
    return out


def test_a_run_leaves_everything_it_promises(finished: Path) -> None:
    summary = json.loads((finished / "summary.json").read_text())
    for table, rates in (
        ("single_step", {"n", "stop_rate"}),
        ("trajectory", {"n", "sr", "osr", "ndtw"}),
        ("original", {"n", "sr", "ndtw"}),
    ):
        for arm in ("clean", "noise", "attacked"):
            assert rates <= summary[table][arm].keys()
            assert summary[table][arm]["n"] >= 12
    assert set(summary["conditions"]) == {"Train", "Validation", "Test"}
    for attack in (finished / "attacks").iterdir():
        for name in ("log.jsonl", "before_after.png", "map.png", "house/scene.xml"):
            assert (attack / name).stat().st_size > 0
    assert len(textures(finished)) == 2


def test_a_killed_run_resumes_to_the_same_texture_and_records(
    finished: Path, tmp_path: Path
) -> None:
    out = tmp_path / "killed"
    process = subprocess.Popen(command(out), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 240
    while not list(out.glob("attacks/*/checkpoints/00002.exr")):
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.05)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    refused = run(out)
    assert refused.returncode == 1 and "--resume" in refused.stderr
    assert "Traceback" not in refused.stderr
    resumed = run(out, "--resume")
    assert resumed.returncode == 0, resumed.stderr
    for name, texture in textures(finished).items():
        np.testing.assert_array_equal(textures(out)[name], texture)
    once, again = (pd.read_parquet(folder / "records.parquet") for folder in (finished, out))
    pd.testing.assert_frame_equal(once, again)


@pytest.mark.parametrize(
    ("setting", "names"),
    [
        ("attack.epsilom=0.1", ["quickstart.yaml", "attack.epsilom"]),
        ("attack.epsilon=two", ["quickstart.yaml", "attack.epsilon", "two"]),
        ("agent=nobody", ["nobody"]),
    ],
)
def test_bad_settings_end_in_one_line(tmp_path: Path, setting: str, names: list[str]) -> None:
    done = run(tmp_path / "bad", "--set", setting)
    assert done.returncode == 1
    assert len(done.stderr.strip().splitlines()) == 1
    assert all(name in done.stderr for name in names)
    assert not (tmp_path / "bad").exists()


@pytest.mark.slow
def test_the_default_samples_are_not_learnt_by_heart_but_one_sample_is(tmp_path: Path) -> None:
    """The loss of the quickstart's textures at other camera rays than those of the attack."""
    out = tmp_path / "overfitting"
    whole = ("attack={}", "rendering=[{attack_spp: 1}, {}]")
    done = run(out, *(part for setting in whole for part in ("--set", setting)))
    assert done.returncode == 0, done.stderr
    gaps: dict[str, list[float]] = {"frozen_1spp": [], "frozen_16spp": []}
    for row in json.loads((out / "summary.json").read_text())["attacks"].values():
        gaps[row["rung"]].append(row["gap"])
    assert max(gaps["frozen_16spp"]) < 0.05 < min(gaps["frozen_1spp"])
