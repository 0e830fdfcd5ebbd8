"""`vlnhijack house render`: the pictures are the views, the masks what they show."""

import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result
from PIL import Image
from typer.testing import CliRunner

from tests.houses import tiny_house
from vlnhijack.cli import app
from vlnhijack.navigation.views import parse_views
from vlnhijack.scenes.house_files import save_house

SIZE = ["--width", "32", "--height", "24"]
VIEWPOINT = tiny_house().graph.viewpoints[0]
TILE = (32 + 6, 24 + 6 + 18)  # with gutter and caption


@pytest.fixture(scope="module")
def houses(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("houses")
    save_house(tiny_house("baked"), folder / "baked")
    save_house(tiny_house("lit"), folder / "lit")
    return folder


def render(house: Path, out: Path, *options: str) -> Result:
    place = [str(house), "--viewpoint", VIEWPOINT, "--out", str(out)]
    return CliRunner().invoke(app, ["house", "render", *place, *SIZE, *options])


def picture(path: Path) -> np.ndarray:
    return np.asarray(Image.open(path)).astype(int)


def tile(sheet: np.ndarray, row: int, column: int) -> np.ndarray:
    x, y = 6 + column * TILE[0], 6 + 18 + row * TILE[1]
    return sheet[y : y + 24, x : x + 32]


def test_views_masks_and_a_panorama_that_looks_up_at_its_top(houses: Path, tmp_path: Path) -> None:
    done = render(houses / "baked", tmp_path, "--views", "1,13-14,25", "--object", "cabinet_0")
    assert done.exit_code == 0, done.output
    views = parse_views("1,13-14,25")
    names = {f"{kind}_{view:02d}.png" for kind in ("view", "mask") for view in views}
    assert {path.name for path in tmp_path.iterdir()} == {*names, "panorama.png"}
    assert all(picture(tmp_path / f"view_{view:02d}.png").shape == (24, 32, 3) for view in views)
    sheet = np.asarray(Image.open(tmp_path / "panorama.png").convert("RGB")).astype(int)
    assert sheet.shape == (3 * TILE[1] + 6, 12 * TILE[0] + 6, 3)
    for view in views:
        row, column = divmod(view, 12)
        seen, mask = (picture(tmp_path / f"{kind}_{view:02d}.png") for kind in ("view", "mask"))
        error = np.abs(tile(sheet, 2 - row, column) - seen).mean(2)
        assert error[mask == 255].max(initial=0) < 25, "256 colours, no line on the object"
        assert np.median(error) < 6
    assert (tile(sheet, 0, 0) == 255).all(), "a view that is not wanted"


def test_a_mask_is_the_object(houses: Path, tmp_path: Path) -> None:
    """Painted red, the cabinet alone is red, and it is where the mask says."""
    house = tiny_house()
    red = np.zeros_like(house.surface("cabinet_0").texture)
    red[..., 0] = 1
    save_house(house.with_texture("cabinet_0", red), tmp_path / "red")
    done = render(
        tmp_path / "red", tmp_path / "out", "--object", "cabinet_0", "--views", "1", "--spp", "64"
    )
    assert done.exit_code == 0, done.output
    seen, mask = (
        picture(tmp_path / "out" / "view_01.png"),
        picture(tmp_path / "out" / "mask_01.png"),
    )
    is_red = (seen[..., 0] - seen[..., 1] > 127) & (seen[..., 1] < 128)
    assert 0.2 < is_red.mean() < 0.8
    assert np.mean(is_red == (mask == 255)) > 0.98


def test_a_view_is_the_same_whichever_others_are_wanted(houses: Path, tmp_path: Path) -> None:
    for name, views in (("a", "3"), ("b", "2-4")):
        assert render(houses / "baked", tmp_path / name, "--views", views).exit_code == 0
    assert (tmp_path / "a/view_03.png").read_bytes() == (tmp_path / "b/view_03.png").read_bytes()
    assert (tmp_path / "b/view_02.png").read_bytes() != (tmp_path / "b/view_03.png").read_bytes()


@pytest.mark.parametrize(
    ("kind", "rung"),
    [("baked", "frozen"), ("baked", "prb"), ("lit", "fixed-illumination"), ("lit", "prb")],
)
def test_every_rung_shows_the_views_of_the_evaluation(
    houses: Path, tmp_path: Path, kind: str, rung: str
) -> None:
    options = ("--views", "1", "--spp", "256")
    for name, more in (("rung", ["--rung", rung]), ("plain", [])):
        done = render(houses / kind, tmp_path / name, *options, *more)
        assert done.exit_code == 0, done.output
    shown, plain = (picture(tmp_path / name / "view_01.png") for name in ("rung", "plain"))
    assert np.abs(shown - plain).max() <= 1 if kind == "baked" else np.abs(shown - plain).mean() < 6
    assert plain.std() > 10


@pytest.mark.parametrize(
    ("options", "line"),
    [
        (["--viewpoint", "nowhere"], f"viewpoint: expected one of {VIEWPOINT}, .*'nowhere'"),
        (["--object", "sofa_9"], "object: expected one of cabinet_0, table_0, received 'sofa_9'"),
        (["--views", "40"], "views: expected indices .* received '40'"),
        (["--rung", "fast"], "rung: expected one of frozen, .* received 'fast'"),
        (["--rung", "fixed-illumination"], "kind: expected lit"),
        (["--rung", "prb", "--spp", "5"], "spp: expected a square number, received 5"),
    ],
)
def test_what_cannot_be_rendered_ends_in_one_line(
    houses: Path, tmp_path: Path, options: list[str], line: str
) -> None:
    done = render(houses / "baked", tmp_path / "out", *options)
    assert done.exit_code == 1
    assert re.match(f"vlnhijack: .*{line}", done.stderr.strip().splitlines()[-1])
    assert not (tmp_path / "out").exists()


def test_without_a_viewpoint_all_are_named(houses: Path, tmp_path: Path) -> None:
    command = ["house", "render", str(houses / "baked"), "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 1
    assert all(name in done.stderr for name in tiny_house().graph.viewpoints)
