"""The renderers' benchmark on a tiny view: its figures are finite and order the renderers."""

import csv
import json
import math
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image
from rich.progress import Progress
from typer.testing import CliRunner

from tests.houses import tiny_house
from vlnhijack.cli import app
from vlnhijack.errors import CheckError, InputError
from vlnhijack.experiments.bench import reference, render, scaling
from vlnhijack.experiments.bench.reference import Mean, Reference
from vlnhijack.experiments.bench.render import Row
from vlnhijack.experiments.bench.scaling import Ladders, Point
from vlnhijack.experiments.bench.subject import Subject, fullest_view
from vlnhijack.frames import Camera
from vlnhijack.scenes.house_files import save_house

FIELDS = {field.name for field in fields(Row)}
CAMERA = Camera((-1.2, -1.2, 1.5), 0.785, -0.4, 32, 24)
QUIET = Progress(disable=True)


@pytest.fixture(autouse=True)
def _short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(render, "REPETITIONS", 2)
    monkeypatch.setattr(scaling, "REPETITIONS", 1)
    monkeypatch.setattr(reference, "SPP_AND_BATCHES", {"baked": (64, 4), "lit": (64, 4)})


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("houses") / "tiny"
    save_house(tiny_house(), folder)
    return folder


def _bench(folder: Path, *options: str) -> dict[tuple[str, int], dict[str, float]]:
    result = CliRunner().invoke(app, ["bench", "render", str(folder), *options])
    assert result.exit_code == 0, result.output
    out = Path(options[options.index("--out") + 1])
    rows = json.loads((out / "render.json").read_text())["rows"]
    assert all(set(row) == FIELDS for row in rows)
    assert all(math.isfinite(row[name]) for row in rows for name in FIELDS - {"rung"})
    return {(row["rung"], row["spp"]): row for row in rows}


def test_frozen_errs_no_more_than_prb(folder: Path, tmp_path: Path) -> None:
    sizes = ["--size", "32", "24", "--spp", "4", "--spp", "16"]
    found = _bench(folder, *sizes, "--out", str(tmp_path))
    assert set(found) == {(rung, spp) for rung in ("frozen", "prb") for spp in (4, 16)}
    assert all(row[name] > 0 for row in found.values() for name in ("forward_s", "build_s", "rmse"))
    for spp in (4, 16):
        frozen, prb = found["frozen", spp], found["prb", spp]
        assert frozen["rmse"] == pytest.approx(prb["rmse"], rel=1e-3)
        assert frozen["grad_cosine"] > prb["grad_cosine"] - 1.5 * (1 - prb["grad_cosine"])
        assert abs(frozen["grad_bias"]) < 0.02
    for rung in ("frozen", "prb"):
        assert found[rung, 16]["rmse"] < 0.6 * found[rung, 4]["rmse"]
        assert 1 - found[rung, 16]["grad_cosine"] < 0.7 * (1 - found[rung, 4]["grad_cosine"])


def test_the_table_and_the_plot_hold_what_the_json_holds(folder: Path, tmp_path: Path) -> None:
    found = _bench(folder, "--size", "32", "24", "--spp", "4", "--out", str(tmp_path), "--baked")
    with (tmp_path / "render.csv").open() as file:
        rows = {(row["rung"], int(row["spp"])): row for row in csv.DictReader(file)}
    assert rows.keys() == found.keys()
    assert float(rows["prb", 4]["rmse"]) == pytest.approx(found["prb", 4]["rmse"])
    with Image.open(tmp_path / "pareto.png") as plot:
        assert len(plot.convert("RGB").getcolors() or []) > 3
    record = json.loads((tmp_path / "render.json").read_text())
    assert record["settings"]["size"] == [32, 24]
    assert 0 < record["reference"]["rmse"] < found["prb", 4]["rmse"]
    assert record["machine"]["variant"] == "llvm_ad_rgb"


def test_a_lit_house_shows_the_bias_of_fixed_illumination(tmp_path: Path) -> None:
    save_house(tiny_house("lit"), tmp_path / "tiny_lit")
    options = ["--size", "16", "12", "--spp", "64", "--out", str(tmp_path / "out"), "--lit"]
    found = _bench(tmp_path / "tiny_lit", *options)
    assert found.keys() == {("fixed-illumination", 64), ("prb", 64)}
    fixed = found["fixed-illumination", 64]
    assert 0.8 < fixed["grad_cosine"] < 1.001
    assert -0.3 < fixed["grad_bias"] < 0.05


def test_errors_leave_out_the_noise_of_the_reference() -> None:
    """A noisy mean of known noise, and a candidate of known error, in 20,000 dimensions."""
    random = np.random.default_rng(0)
    truth, noise, off = (torch.from_numpy(x) for x in random.standard_normal((3, 20_000)))
    mean = Mean(truth + 0.3 * noise, 0.09 * len(truth))
    candidate = truth + 0.5 * off
    errors = Reference(mean, mean).errors(candidate, candidate)
    assert errors.rmse == pytest.approx(0.5, rel=0.02)
    assert errors.grad_cosine == pytest.approx(1 / 1.25**0.5, rel=0.02)
    assert errors.grad_norm_ratio == pytest.approx(1.25**0.5, rel=0.02)
    assert errors.grad_bias == pytest.approx(0, abs=0.02)


def test_the_references_noise_is_that_of_its_batches() -> None:
    subject = Subject(tiny_house(), "cabinet_0", [CAMERA])
    short, long = (_converged(subject, batches) for batches in (4, 32))
    assert short.image.noise / long.image.noise == pytest.approx(8, rel=0.3)
    difference = float((short.image.value - long.image.value).square().sum())
    assert difference == pytest.approx(short.image.noise + long.image.noise, rel=0.5)


def _converged(subject: Subject, batches: int) -> Reference:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reference, "SPP_AND_BATCHES", {"baked": (4, batches)})
        return reference.converged(subject, lambda: None)


def test_every_ladder_has_points_for_both_rungs() -> None:
    subject = Subject(tiny_house(), "cabinet_0", [CAMERA])
    ladders = Ladders(most_faces=200, texture_sides=(16, 32), views=(1, 2), spps=(1, 4))
    points = scaling.bench_scaling(subject, ladders, QUIET)
    values = {(p.axis, p.value) for p in points if p.rung == "frozen"}
    faces = sorted(value for axis, value in values if axis == "faces")
    assert faces[-1] >= 200 and all(b == 4 * a for a, b in zip(faces, faces[1:], strict=False))
    rest = {("texels", 256), ("texels", 1024), ("views", 1), ("views", 2)}
    assert values - {("faces", n) for n in faces} == rest | {("samples", 1), ("samples", 4)}
    assert values == {(p.axis, p.value) for p in points if p.rung == "prb"}
    fits = scaling.exponents(points)
    assert len(fits) == 8 and all(math.isfinite(fit["build_s"]) for fit in fits)  # type: ignore[arg-type]


def test_exponents_are_slopes() -> None:
    points = [Point("faces", n, "prb", n**0.5, 3.0, 2.0 * n) for n in (10, 100, 1000)]
    (fit,) = scaling.exponents(points)
    assert fit["forward_backward_s"] == pytest.approx(0.5)
    assert fit["build_s"] == pytest.approx(0, abs=1e-9)
    assert fit["memory_mb"] == pytest.approx(1)


def test_an_unknown_object_is_one_line(folder: Path) -> None:
    result = CliRunner().invoke(app, ["bench", "render", str(folder), "--object", "sofa_9"])
    assert result.exit_code == 1
    assert "object: expected one of cabinet_0, table_0, received 'sofa_9'" in result.stderr


def test_a_house_of_the_other_kind_is_refused(folder: Path) -> None:
    result = CliRunner().invoke(app, ["bench", "render", str(folder), "--lit"])
    assert result.exit_code == 1
    assert "kind: expected lit, received 'baked'" in result.stderr


def test_the_fullest_view_can_be_narrowed_to_an_object_and_a_viewpoint() -> None:
    house = tiny_house()
    object_id, view = fullest_view(house)
    assert object_id == "cabinet_0"
    assert fullest_view(house, object_id, view.viewpoint) == (object_id, view)
    other = next(name for name in house.graph.viewpoints if name != view.viewpoint)
    assert fullest_view(house, "table_0", other)[1].viewpoint == other
    with pytest.raises(InputError, match="viewpoint"):
        fullest_view(house, viewpoint="nowhere")


def test_a_view_without_the_object_is_refused() -> None:
    away = replace(CAMERA, heading=CAMERA.heading + np.pi, elevation=0.4)
    with pytest.raises(CheckError, match="lost in noise"):
        reference.converged(Subject(tiny_house(), "cabinet_0", [away]), lambda: None)


def test_a_number_of_samples_that_is_no_square_is_refused() -> None:
    subject = Subject(tiny_house(), "cabinet_0", [CAMERA])
    with pytest.raises(InputError, match="spp: expected"):
        render.bench_render(subject, [5], QUIET)
