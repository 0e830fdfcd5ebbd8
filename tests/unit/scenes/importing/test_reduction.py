"""Fewer faces and texels: the same borders, a picture that stays near."""

from dataclasses import replace

import numpy as np
import pytest
from rich.progress import Progress

from tests.source_room import ROOM, furnished_room, line_graph, picture
from vlnhijack import display
from vlnhijack.errors import InputError
from vlnhijack.experiments.reduce_house import Budget, parse_budget, reduce_folder
from vlnhijack.scenes.house import House
from vlnhijack.scenes.house_files import load_house, save_house
from vlnhijack.scenes.importing.assemble import assemble
from vlnhijack.scenes.importing.reduction import face_count, reduce_faces, reduce_texels
from vlnhijack.scenes.importing.unwrapping import unwrapped
from vlnhijack.scenes.surface import Surface
from vlnhijack.scenes.uv_atlas import has_overlap


def room() -> House:
    return assemble(furnished_room(), "made", line_graph("made"), [ROOM])


def hilly(cells: int = 40) -> Surface:
    """A gentle square of 2 m whose texture coordinates are its x and y over 2."""
    x, y = np.meshgrid(*[np.linspace(0, 2, cells + 1)] * 2)
    vertices = np.stack([x, y, 0.05 * np.sin(3 * x)], -1).reshape(-1, 3).astype(np.float32)
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    square = np.stack([corner, corner + 1, corner + cells + 2, corner + cells + 1], 1)
    faces = np.concatenate([square[:, [0, 1, 2]], square[:, [0, 2, 3]]]).astype(np.int32)
    texture = display.from_8bit(picture("hilly", 64, 64))
    return Surface("hilly", vertices, faces, vertices[:, :2] / 2, texture)


def with_hill(house: House) -> House:
    return replace(house, surfaces=(*house.surfaces, hilly()))


def test_borders_and_texture_coordinates_stay() -> None:
    before = hilly()
    after = reduce_faces(with_hill(room()), 700).surfaces[-1]
    assert len(after.faces) < 0.4 * len(before.faces)

    def border(surface: Surface) -> set[tuple[float, ...]]:
        xy = surface.vertices[:, :2]
        on_edge = ((xy == 0) | (xy == 2)).any(axis=1)
        return {tuple(v) for v in surface.vertices[on_edge].tolist()}

    assert border(after) == border(before)
    assert np.abs(after.uv - after.vertices[:, :2] / 2).max() < 0.01


def test_texels_of_shared_textures_and_atlases() -> None:
    house = reduce_texels(unwrapped(room(), ["table_0"]), 128)
    assert max(max(s.texture.shape) for s in house.surfaces) == 128
    table = house.surface("table_0")
    assert not has_overlap(table.uv, table.faces, 128)
    smaller = reduce_texels(room(), 48)
    walls = [s.texture.shape for s in smaller.surfaces]
    assert (36, 48, 3) in walls
    assert len({id(s.texture) for s in smaller.surfaces}) == 4


def test_auto_keeps_the_stated_error(tmp_path) -> None:
    save_house(with_hill(room()), tmp_path / "made")
    with Progress(disable=True) as progress:
        rows, last = reduce_folder(tmp_path / "made", tmp_path / "small", None, 0.01, progress)
    kept = [row for row in rows if row.rmse <= 0.01]
    assert rows[0].rmse == 0
    assert face_count(load_house(tmp_path / "small")) == min(row.faces for row in kept)
    assert kept[-1].megabytes < rows[0].megabytes
    assert last == kept[-1]


@pytest.mark.parametrize("max_error", [0.0, -1.0, float("nan")])
def test_an_error_that_nothing_keeps_is_refused(tmp_path, max_error: float) -> None:
    save_house(room(), tmp_path / "made")
    with Progress(disable=True) as progress, pytest.raises(InputError, match="max-error"):
        reduce_folder(tmp_path / "made", tmp_path / "small", None, max_error, progress)
    assert not (tmp_path / "small").exists()


def test_a_reduced_house_has_the_episodes_of_the_original_alone(tmp_path) -> None:
    save_house(room(), tmp_path / "made", {"train": [{"path_id": 7}]})
    save_house(room(), tmp_path / "small", {"val_unseen": []})
    with Progress(disable=True) as progress:
        for out in ("small", "made"):
            reduce_folder(tmp_path / "made", tmp_path / out, Budget(2000), 0.01, progress)
            (kept,) = (tmp_path / out / "episodes").iterdir()
            assert kept.name == "train.json"
        (tmp_path / "notes.txt").write_text("kept")
        with pytest.raises(InputError, match="other files"):
            reduce_folder(tmp_path / "made", tmp_path, Budget(2000), 0.01, progress)
    assert (tmp_path / "notes.txt").exists()


def test_budgets() -> None:
    assert parse_budget("auto") is None
    assert parse_budget("5000") == Budget(5000)
    assert parse_budget("5000x256") == Budget(5000, 256)
    with pytest.raises(InputError, match="budget"):
        parse_budget("half")
