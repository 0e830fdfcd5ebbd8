"""The renderers' benchmark on a tiny view: its figures are finite and order the renderers."""

import json
import math
from pathlib import Path

import pytest
from rich.progress import Progress
from typer.testing import CliRunner

from tests.houses import tiny_house
from vlnhijack.cli import app
from vlnhijack.errors import InputError
from vlnhijack.experiments import bench_render as bench
from vlnhijack.navigation.views import View
from vlnhijack.scenes.house_files import save_house

FIELDS = {
    "rung",
    "spp",
    "forward_s",
    "forward_backward_s",
    "build_s",
    "memory_mb",
    "rmse",
    "psnr",
    "grad_cosine",
    "grad_norm_ratio",
}


@pytest.fixture(autouse=True)
def _short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, "REPETITIONS", 2)
    monkeypatch.setattr(bench, "REFERENCE_BATCHES", 4)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("houses") / "tiny"
    save_house(tiny_house(), folder)
    return folder


def test_rows_are_finite_and_frozen_errs_no_more_than_prb(folder: Path, tmp_path: Path) -> None:
    options = ["--width", "32", "--height", "24", "--out", str(tmp_path)]
    result = CliRunner().invoke(app, ["bench", "render", str(folder), *options])
    assert result.exit_code == 0, result.output
    rows = json.loads((tmp_path / "render.json").read_text())["rows"]
    assert all(set(row) == FIELDS for row in rows)
    assert all(math.isfinite(row[name]) for row in rows for name in FIELDS - {"rung"})
    assert all(row[name] > 0 for row in rows for name in ("forward_s", "build_s", "rmse", "psnr"))
    found = {(row["rung"], row["spp"]): row for row in rows}
    assert set(found) == {(rung, spp) for rung in ("frozen", "prb") for spp in (4, 16)}
    for spp in (4, 16):
        frozen, prb = found["frozen", spp], found["prb", spp]
        assert frozen["rmse"] <= 1.001 * prb["rmse"]
        assert 1 - frozen["grad_cosine"] <= 1.5 * (1 - prb["grad_cosine"])
        assert frozen["grad_norm_ratio"] == pytest.approx(prb["grad_norm_ratio"], rel=0.2)
    for rung in ("frozen", "prb"):
        assert found[rung, 16]["rmse"] < 0.6 * found[rung, 4]["rmse"]
        assert 1 - found[rung, 16]["grad_cosine"] < 0.7 * (1 - found[rung, 4]["grad_cosine"])


def test_an_unknown_object_is_one_line(folder: Path) -> None:
    result = CliRunner().invoke(app, ["bench", "render", str(folder), "--object", "sofa_9"])
    assert result.exit_code == 1
    assert "object: expected one of cabinet_0, table_0, received 'sofa_9'" in result.stderr


def test_the_fullest_view_can_be_narrowed_to_an_object_and_a_viewpoint() -> None:
    house = tiny_house()
    object_id, view = bench.fullest_view(house)
    assert object_id == "cabinet_0"
    assert bench.fullest_view(house, object_id, view.viewpoint) == (object_id, view)
    other = next(name for name in house.graph.viewpoints if name != view.viewpoint)
    assert bench.fullest_view(house, "table_0", other)[1].viewpoint == other
    with pytest.raises(InputError, match="viewpoint"):
        bench.fullest_view(house, viewpoint="nowhere")


@pytest.mark.parametrize(("kind", "spp", "field"), [("lit", 4, "kind"), ("baked", 5, "spp")])
def test_what_cannot_be_measured_is_refused(kind: str, spp: int, field: str) -> None:
    house = tiny_house("lit" if kind == "lit" else "baked")
    view = View(house.graph.viewpoints[0], 0)
    with pytest.raises(InputError, match=f"{field}: expected"):
        bench.bench_render(
            house, "cabinet_0", view.viewpoint, view.index, (32, 24), [spp], Progress(disable=True)
        )
