"""`vlnhijack house import mesh` writes a whole house or nothing."""

from pathlib import Path

import pytest
from rich.progress import Progress
from typer.testing import CliRunner

from tests.houses import tiny_house
from tests.mesh_files import write_glb, write_ply
from vlnhijack.cli import app
from vlnhijack.errors import InputError
from vlnhijack.experiments.house_info import describe
from vlnhijack.experiments.import_house import ImportOptions, import_mesh, unwrap_folder
from vlnhijack.scenes.house_files import load_house, save_house

EXAMPLE = Path(__file__).parents[3] / "docs" / "examples" / "apartment.glb"


def test_import_then_unwrap(tmp_path) -> None:
    write_glb(tmp_path / "mesh.glb")
    folder = tmp_path / "scenes" / "small"
    with Progress(disable=True) as progress:
        lines = import_mesh(tmp_path / "mesh.glb", "small", folder, ImportOptions(), progress)
    assert any("1 chair" in line for line in lines)
    house = load_house(folder)
    assert house.kind == "baked"
    assert [(o.id, o.unwrapped) for o in house.objects] == [("chair_00", False)]
    unwrap_folder(folder, [])
    assert load_house(folder).surface("chair_00").wrap == "clamp"


def test_an_old_house_is_replaced_with_all_its_episodes(tmp_path) -> None:
    write_glb(tmp_path / "mesh.glb")
    folder = tmp_path / "small"
    save_house(tiny_house(), folder, {"val_unseen": [], "train": [{"path_id": 7}]})
    with Progress(disable=True) as progress:
        import_mesh(tmp_path / "mesh.glb", "small", folder, ImportOptions(), progress)
    assert sorted(p.name for p in (folder / "episodes").iterdir()) == [
        "train.json",
        "val_seen.json",
    ]
    assert 'path_id": 7' not in (folder / "episodes" / "train.json").read_text()


def test_other_files_are_kept_before_any_work(tmp_path) -> None:
    write_glb(tmp_path / "mesh.glb")
    progress = Progress(disable=True)
    with pytest.raises(InputError, match="other files"):
        import_mesh(tmp_path / "mesh.glb", "small", tmp_path, ImportOptions(), progress)
    assert not progress.tasks
    assert [path.name for path in tmp_path.iterdir()] == ["mesh.glb"]


def test_a_coloured_mesh_without_objects(tmp_path) -> None:
    write_ply(tmp_path / "mesh.ply", size=(4, 6, 2.5))
    folder = tmp_path / "plain"
    with Progress(disable=True) as progress:
        lines = import_mesh(tmp_path / "mesh.ply", "plain", folder, ImportOptions(), progress)
    assert "objects: none" in lines
    house = load_house(folder)
    assert house.surfaces[0].texture.std() > 0.1
    assert describe(house).warnings == (), "the box was turned inside out"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--name", "a b"], "letters, digits"),
        (["--name", "small", "--scale", "1000"], "--scale 0.001"),
        (["--name", "small", "--objects", "none.json"], "none.json"),
        (["--name", "small", "--connectivity", "nowhere"], "small_connectivity.json"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(tmp_path, arguments, words: str) -> None:
    write_glb(tmp_path / "mesh.glb")
    out = tmp_path / "scenes" / "small"
    command = ["house", "import", "mesh", str(tmp_path / "mesh.glb"), "--out", str(out)]
    result = CliRunner().invoke(app, [*command, *arguments])
    assert result.exit_code == 1
    assert words in result.stderr
    assert "Traceback" not in result.output
    assert not out.parent.exists()


@pytest.mark.slow
def test_the_documented_flat(tmp_path) -> None:
    folder = tmp_path / "apartment"
    with Progress(disable=True) as progress:
        import_mesh(EXAMPLE, "apartment", folder, ImportOptions(), progress)
    house = load_house(folder)
    categories = [thing.category for thing in house.objects]
    assert {name: categories.count(name) for name in ("sofa", "chair", "bed")} == {
        "sofa": 2,
        "chair": 4,
        "bed": 1,
    }
    assert len(house.graph.viewpoints) >= 25
    assert (folder / "episodes" / "train.json").stat().st_size > 10_000
    result = CliRunner().invoke(app, ["house", "info", str(folder)])
    assert result.exit_code == 0
    assert "warning" not in result.output
