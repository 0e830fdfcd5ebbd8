"""A house comes back from disk as it was saved, and a damaged one is refused in one line."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from tests.houses import tiny_house
from vlnhijack.errors import InputError
from vlnhijack.scenes.house import House
from vlnhijack.scenes.house_files import load_house, read_texture, save_house


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    save_house(tiny_house("lit"), tmp_path / "house", {"train": [{"path_id": 7}]})
    return tmp_path / "house"


def _edit(path: Path, change: Callable[[Any], object]) -> None:
    value = json.loads(path.read_text())
    change(value)
    path.write_text(json.dumps(value))


@pytest.mark.parametrize("kind", ["baked", "lit"])
def test_round_trip(tmp_path: Path, kind: Any) -> None:
    house = tiny_house(kind)
    save_house(house, tmp_path / "house")
    loaded = load_house(tmp_path / "house")
    for field in ("name", "kind", "objects", "rooms", "lights", "exposure"):
        assert getattr(loaded, field) == getattr(house, field)
    for saved, read in zip(house.surfaces, loaded.surfaces, strict=True):
        assert (saved.name, saved.object_id) == (read.name, read.object_id)
        for field in ("vertices", "faces", "uv", "texture"):
            assert np.array_equal(getattr(saved, field), getattr(read, field))
    assert loaded.graph.viewpoints == house.graph.viewpoints
    assert np.array_equal(loaded.graph.positions, house.graph.positions)
    assert np.array_equal(loaded.graph.adjacency, house.graph.adjacency)


def test_textures_are_rounded_to_the_nearest_level(tmp_path: Path) -> None:
    house = tiny_house()
    texture = np.random.default_rng(0).random((64, 64, 3), np.float32)
    save_house(house.with_texture("cabinet_0", texture), tmp_path / "house")
    loaded = load_house(tmp_path / "house").surface("cabinet_0").texture
    levels = np.asarray(Image.open(tmp_path / "house/textures/cabinet_0.png"))
    assert np.array_equal(loaded, levels / np.float32(255))
    assert np.abs(loaded - texture).max() <= 0.5 / 255 + 1e-6


def test_other_files_are_not_replaced_by_a_house(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("kept")
    with pytest.raises(InputError, match="house.json, received 'other files'"):
        save_house(tiny_house(), tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_saving_twice_gives_the_same_files_and_keeps_episodes(folder: Path) -> None:
    before = {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}
    save_house(tiny_house("lit"), folder)
    after = {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}
    assert before == after and Path("episodes/train.json") in after
    assert [p.name for p in folder.parent.iterdir()] == ["house"]


@pytest.mark.parametrize(
    "name",
    [
        "house.json",
        "objects.json",
        "tiny_lit_connectivity.json",
        "meshes/shell.ply",
        "textures/table_0.png",
    ],
)
@pytest.mark.parametrize("damage", ["missing", "truncated", "garbage"])
def test_damaged_files_are_named(folder: Path, name: str, damage: str) -> None:
    path = folder / name
    if damage == "missing":
        path.unlink()
    elif damage == "truncated":
        path.write_bytes(path.read_bytes()[:40])
    else:
        path.write_bytes(b"\x80\x00garbage")
    with pytest.raises(InputError) as caught:
        load_house(folder)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "file, change, words",
    [
        ("house.json", lambda h: h.update(format=2), "format: .*received 2"),
        ("house.json", lambda h: h.update(exposure="bright"), "exposure.*bright"),
        ("house.json", lambda h: h.update(exposure=float("nan")), "exposure"),
        ("house.json", lambda h: h.update(colour=1), "colour"),
        ("house.json", lambda h: h.pop("rooms"), "rooms"),
        ("house.json", lambda h: h["rooms"][0].update(bounds=[0, 1]), r"rooms\.0\.bounds"),
        ("house.json", lambda h: h["surfaces"][1].update(object=None), "objects"),
        ("house.json", lambda h: h["surfaces"].append(h["surfaces"][0]), "distinct"),
        ("house.json", lambda h: h["surfaces"][0].update(mesh="../x.ply"), "inside the house"),
        ("house.json", lambda h: h["surfaces"][0].update(mesh="/etc/passwd"), "inside the house"),
        ("house.json", lambda h: h["surfaces"][0].update(mesh="objects.json"), "an entry in"),
        ("house.json", lambda h: h.update(surfaces=[]), "1 surface"),
        ("house.json", lambda h: h.update(name="../tiny"), "name"),
        ("objects.json", lambda o: o.pop(), "objects"),
        ("objects.json", lambda o: o[0].update(room="attic"), "attic"),
        ("objects.json", lambda o: o[0].pop("category"), r"0\.category"),
    ],
)
def test_wrong_values_are_named(
    folder: Path, file: str, change: Callable[[Any], object], words: str
) -> None:
    _edit(folder / file, change)
    with pytest.raises(InputError, match=words):
        load_house(folder)


def test_a_texture_that_is_not_8_bit_rgb_is_refused(folder: Path) -> None:
    path = folder / "textures/table_0.png"
    Image.new("L", (4, 4)).save(path)
    with pytest.raises(InputError, match="received 'PNG L'"):
        read_texture(path)


@pytest.mark.parametrize(
    "change",
    [
        lambda h: replace(h, objects=h.objects[:1]),
        lambda h: replace(h, name="a/b"),
        lambda h: replace(h, graph=replace(h.graph, scan="other")),
    ],
)
def test_an_inconsistent_house_leaves_the_old_folder(
    folder: Path, change: Callable[[House], House]
) -> None:
    with pytest.raises(InputError):
        save_house(change(tiny_house("lit")), folder)
    assert load_house(folder).name == "tiny_lit"
