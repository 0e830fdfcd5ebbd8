"""The attack's benchmark at a tiny scale: its two ways agree, and its figures are whole."""

import json
import math
from functools import partial
from pathlib import Path

import pytest
import torch
from typer.testing import CliRunner

from vlnhijack.agents.hamt_config import HamtConfig
from vlnhijack.agents.vit import VitConfig
from vlnhijack.attack.optimise import Stopwatch, loss_and_gradient
from vlnhijack.cli import app
from vlnhijack.errors import InputError
from vlnhijack.experiments.bench import paper_scale as module
from vlnhijack.experiments.bench.attack import one_by_one, precisions
from vlnhijack.experiments.bench.paper_scale import (
    PRESETS,
    PaperScale,
    Preset,
    Scale,
    paper_scale,
)
from vlnhijack.settings import house_folder

SMALL = Scale(batch=3, width=32, height=24, spp=1)
POLICY = HamtConfig(
    hidden_size=16,
    num_attention_heads=2,
    intermediate_size=32,
    vocab_size=50,
    num_l_layers=1,
    num_x_layers=2,
    num_h_pano_layers=1,
    image_feat_size=8,
)
TINY = Preset(VitConfig((8, 8), 4, 8, 1, 2), POLICY, mean=9, deviation=4, longest=14)


@pytest.fixture(scope="module")
def scale() -> PaperScale:
    return paper_scale(TINY, house_folder("alder"), 0, SMALL)


def test_eighteen_views_of_three_viewpoints_and_five_steps(scale: PaperScale) -> None:
    assert (
        torch.bincount(torch.unique(scale.viewpoints, return_inverse=True)[1]).tolist() == [6] * 3
    )
    assert len(scale.instance.trajectory) + 1 == 5, "four moves and STOP"
    assert {len(episode.encoding or ()) for episode in scale.instance.train} <= set(range(3, 15))
    names = [scale.table.viewpoint(row) for row in scale.viewpoints[::6].tolist()]
    assert names == scale.instance.target_path[:3]


def test_the_batch_is_its_episodes_one_by_one(scale: PaperScale) -> None:
    views, objective = scale.problem(scale.agent())
    texture = scale.texture().value
    alone = [one_by_one(texture, views, objective, episode) for episode in range(3)]
    loss, gradient = loss_and_gradient(texture, views, objective, torch.arange(3), Stopwatch())
    assert loss == pytest.approx(sum(loss for loss, _ in alone) / 3, rel=1e-5)
    torch.testing.assert_close(
        gradient, sum(part for _, part in alone) / 3, rtol=1e-3, atol=1e-4 * gradient.abs().max()
    )
    assert gradient.any()


def test_the_figures_are_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(PRESETS, "r2r", TINY)
    monkeypatch.setattr(module, "paper_scale", partial(paper_scale, scale=SMALL))
    monkeypatch.setattr(
        "vlnhijack.experiments.bench.attack.precisions",
        lambda preset: [("float32", "float32"), ("bfloat16", "bfloat16")],
    )
    options = ["bench", "attack", "--out", str(tmp_path), "--json", "--threads", "1"]
    result = CliRunner().invoke(app, options)
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    assert set(found) == {
        "seconds_per_iteration",
        "naive_seconds_per_iteration",
        "stages",
        "peak_memory_mb",
        "grad_cosine",
        "loss_error",
    }
    assert set(found["stages"]) == {"render", "vision", "policy", "backward", "update"}
    figures = [*found.pop("stages").values(), *found.values()]
    assert all(math.isfinite(figure) and figure > 0 for figure in figures)
    assert 0.95 < found["grad_cosine"] < 1
    exact, _ = json.loads((tmp_path / "attack.json").read_text())["rows"]
    assert exact["grad_cosine"] == pytest.approx(1)
    assert exact["loss_error"] == 0


@pytest.mark.parametrize("preset", PRESETS.values(), ids=PRESETS)
def test_full_size_agents_multiply_in_bfloat16_by_default(preset: Preset) -> None:
    assert precisions(preset)[0] == ("float32", "float32")
    assert precisions(preset)[-1] == ("bfloat16", "bfloat16")
    assert precisions(TINY) == [("float32", "float32")]


def test_a_house_without_such_a_place_is_refused() -> None:
    with pytest.raises(InputError, match="30 views of each of 3 viewpoints"):
        paper_scale(TINY, house_folder("alder"), 0, Scale(batch=3, views=30))
