"""Scans are imported whole or not at all."""

import json
import shutil
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.progress import Progress

from tests.fuzz import broken
from tests.houses import tiny_house
from tests.scans import import_quietly, pack, tiny_scan
from vlnhijack.errors import InputError
from vlnhijack.experiments.import_house import ImportOptions
from vlnhijack.experiments.import_scan import import_scan
from vlnhijack.scenes.house_files import load_house, save_house
from vlnhijack.scenes.importing.mesh_file import ReadOptions
from vlnhijack.scenes.matterport.export import export_scan
from vlnhijack.scenes.ply import read_elements, write_elements

NAME = "tiny_baked"
SEGMENTATION = Path("house_segmentations")
MESH = Path("matterport_mesh") / NAME


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tiny_scan(tmp_path_factory.mktemp("whole"))


@pytest.fixture
def scan(whole: Path, tmp_path: Path) -> Path:
    shutil.copytree(whole.parent, tmp_path / "scans")
    return tmp_path / "scans" / whole.name


def edit(file: Path, change: Callable[[Any], Any]) -> None:
    file.write_text(json.dumps(change(json.loads(file.read_text()))))


def test_packed_and_plain_scans_are_the_same(scan: Path, tmp_path: Path) -> None:
    plain = import_quietly(scan, tmp_path / "plain")
    pack(scan)
    assert sorted(path.suffix for path in scan.iterdir()) == [".zip", ".zip"]
    packed = import_quietly(scan, tmp_path / "packed")
    assert plain[:-1] == packed[:-1]
    for file in ("house.json", "objects.json", f"{NAME}_connectivity.json"):
        assert (tmp_path / "plain" / file).read_bytes() == (tmp_path / "packed" / file).read_bytes()


@pytest.mark.parametrize("unwrap_all", [False, True])
def test_the_bar_of_an_import_ends_full(scan: Path, tmp_path: Path, unwrap_all: bool) -> None:
    options = ImportOptions(ReadOptions(up="z"), unwrap_all=unwrap_all)
    with Progress(disable=True) as progress:
        import_scan(scan, scan.parent / "connectivity", tmp_path / "house", options, progress)
    assert progress.tasks[0].completed == progress.tasks[0].total


def test_graphs_of_several_houses_lie_together(tmp_path: Path) -> None:
    for name in ("second", "first"):
        house = replace(tiny_house(), name=name)
        graph = replace(house.graph, scan=name)
        export_scan(replace(house, graph=graph), tmp_path, [])
    assert (tmp_path / "connectivity" / "scans.txt").read_text() == "first\nsecond\n"


def test_a_house_is_not_replaced_by_its_scan(tmp_path: Path) -> None:
    save_house(tiny_house(), tmp_path / NAME)
    with pytest.raises(InputError, match="matterport_mesh, received 'other files'"):
        tiny_scan(tmp_path)
    assert load_house(tmp_path / NAME).name == NAME


def test_a_scan_is_not_replaced_by_its_house(scan: Path) -> None:
    with pytest.raises(InputError, match="house.json, received 'other files'"):
        import_quietly(scan, scan)
    assert (scan / MESH).is_dir()


@pytest.mark.parametrize("wrong", ["lit", "mirror"])
def test_what_the_layout_cannot_hold_is_not_exported(tmp_path: Path, wrong: str) -> None:
    house = tiny_house("lit" if wrong == "lit" else "baked")
    if wrong == "mirror":
        surfaces = tuple(replace(surface, wrap="mirror") for surface in house.surfaces)
        house = replace(house, surfaces=surfaces)
    with pytest.raises(InputError, match=wrong):
        export_scan(house, tmp_path / "out", [])
    assert not (tmp_path / "out").exists()


def test_walls_and_floors_are_background(scan: Path, tmp_path: Path) -> None:
    file = scan / SEGMENTATION / f"{NAME}.house"
    file.write_text(file.read_text().replace("5 table  5 table", "2 rug  2 floor"))
    import_quietly(scan, tmp_path / "house")
    (thing,) = load_house(tmp_path / "house").objects
    assert (thing.id, thing.category) == ("0", "cabinet")


def test_objects_without_faces_are_named(scan: Path, tmp_path: Path) -> None:
    mesh = scan / MESH / f"{NAME}.obj"
    lines = mesh.read_text().splitlines()
    last = max(row for row, line in enumerate(lines) if line.startswith("usemtl"))
    mesh.write_text("\n".join(lines[:last]))
    printed = import_quietly(scan, tmp_path / "house")
    assert "objects without faces, left out: 1" in printed
    assert [o.id for o in load_house(tmp_path / "house").objects] == ["0"]


def test_a_missing_image_is_named_and_replaced_on_demand(scan: Path, tmp_path: Path) -> None:
    (scan / MESH / f"{NAME}_001.jpg").unlink()
    with pytest.raises(InputError, match=f"{NAME}_001.jpg.*--allow-missing"):
        import_quietly(scan, tmp_path / "house")
    assert not (tmp_path / "house").exists()
    printed = import_quietly(scan, tmp_path / "house", allow_missing=True)
    assert f"{NAME}_001.jpg" in printed[0]
    flat = load_house(tmp_path / "house").parts("0")[0].texture
    assert flat.shape == (1, 1, 3)


def _swap_groups(content: dict[str, Any]) -> dict[str, Any]:
    groups = content["segGroups"]
    groups[0]["segments"], groups[1]["segments"] = [0], [1, 2]
    return content


@pytest.mark.parametrize(
    ("name", "change", "expected"),
    [
        ("fsegs", lambda c: {"segIndices": c["segIndices"][:-1]}, "segIndices: expected"),
        ("fsegs", lambda c: {"segIndices": ["1"]}, r"segIndices\.0: expected a valid integer"),
        ("semseg", lambda c: {"segGroups": 3}, "segGroups: expected a valid list"),
        ("semseg", lambda c: {"segGroups": c["segGroups"][:1] * 2}, "segments of no other group"),
        ("semseg", _swap_groups, "the objects of tiny_baked.ply on ≥ 90%"),
        ("semseg", lambda c: {"segGroups": [{"segments": [77]}]}, "the objects of tiny_baked.ply"),
    ],
)
def test_broken_groups_are_named(
    scan: Path, tmp_path: Path, name: str, change: Callable[[Any], Any], expected: str
) -> None:
    edit(scan / SEGMENTATION / f"{NAME}.{name}.json", change)
    with pytest.raises(InputError, match=rf"{NAME}\.{name}\.json: .*{expected}"):
        import_quietly(scan, tmp_path / "house")
    assert not (tmp_path / "house").exists()


def test_objects_that_are_not_listed_are_refused(scan: Path, tmp_path: Path) -> None:
    file = scan / SEGMENTATION / f"{NAME}.ply"
    elements = read_elements(file)
    vertex = {axis: elements["vertex"][axis] for axis in "xyz"}
    numbers = {"segment_id": elements["face"]["segment_id"] + 5}
    write_elements(file, vertex, elements["face"]["vertex_indices"], numbers)
    with pytest.raises(InputError, match=r"segment_id: expected objects in \[-1, 2\)"):
        import_quietly(scan, tmp_path / "house")
    write_elements(file, vertex, elements["face"]["vertex_indices"], {})
    with pytest.raises(InputError, match="a property segment_id of each face"):
        import_quietly(scan, tmp_path / "house")
    vertex["x"] = np.full_like(vertex["x"], np.nan)
    numbers["segment_id"] -= 5
    write_elements(file, vertex, elements["face"]["vertex_indices"], numbers)
    with pytest.raises(InputError, match="vertices: expected finite"):
        import_quietly(scan, tmp_path / "house")


@pytest.mark.parametrize("member", ["../outside.obj", "/tmp/outside.obj", "a/../../outside.obj"])
def test_members_outside_the_folder_are_refused(scan: Path, tmp_path: Path, member: str) -> None:
    pack(scan)
    with zipfile.ZipFile(scan / "matterport_mesh.zip", "a") as archive:
        archive.writestr(member, "v 0 0 0")
    with pytest.raises(InputError, match=r"matterport_mesh.zip: members: expected files inside"):
        import_quietly(scan, tmp_path / "house")
    assert not (tmp_path / "house").exists()
    assert not list(tmp_path.rglob("outside.obj"))


def test_links_in_archives_are_refused(scan: Path, tmp_path: Path) -> None:
    pack(scan)
    link = zipfile.ZipInfo(f"{NAME}/link.obj")
    link.external_attr = 0o120777 << 16
    with zipfile.ZipFile(scan / "matterport_mesh.zip", "a") as archive:
        archive.writestr(link, "/etc/passwd")
    with pytest.raises(InputError, match="members: expected files inside"):
        import_quietly(scan, tmp_path / "house")


@pytest.mark.parametrize(
    ("missing", "expected"),
    [
        ("matterport_mesh", "expected matterport_mesh or matterport_mesh.zip"),
        (str(MESH / f"{NAME}.obj"), r"expected one \*.obj file, received 'none'"),
        (str(MESH / f"{NAME}.mtl"), "tiny_baked.mtl"),
        (str(SEGMENTATION / f"{NAME}.house"), r"expected one \*.house file"),
        (str(SEGMENTATION / f"{NAME}.ply"), "expected a PLY mesh"),
        (str(SEGMENTATION / f"{NAME}.fsegs.json"), "fsegs.json: expected a file"),
        ("../connectivity/tiny_baked_connectivity.json", "expected a folder or archive"),
    ],
)
def test_a_missing_file_is_named(scan: Path, tmp_path: Path, missing: str, expected: str) -> None:
    path = scan / missing
    shutil.rmtree(path) if path.is_dir() else path.unlink()
    with pytest.raises(InputError, match=expected):
        import_quietly(scan, tmp_path / "house")
    assert not (tmp_path / "house").exists()


@pytest.fixture(scope="module")
def fuzzed(whole: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("fuzzed") / "scans"
    shutil.copytree(whole.parent, folder)
    return folder / whole.name


FILES = [
    *(MESH / name for name in (f"{NAME}.obj", f"{NAME}.mtl", f"{NAME}_000.jpg")),
    *(SEGMENTATION / f"{NAME}.{end}" for end in ("house", "ply", "fsegs.json", "semseg.json")),
]


def changed(content: bytes, data: st.DataObject, suffix: str) -> bytes:
    """Cut off, overwritten in one place, or, if JSON, another value."""
    if suffix == ".json" and data.draw(st.booleans()):
        return json.dumps(data.draw(broken(json.loads(content)))).encode()
    at = data.draw(st.integers(0, len(content)))
    junk = data.draw(st.binary(max_size=6))
    return content[:at] + junk + (content[at + len(junk) :] if data.draw(st.booleans()) else b"")


@settings(max_examples=60, deadline=None)
@given(data=st.data(), file=st.sampled_from(FILES))
def test_no_file_ends_in_a_traceback(
    whole: Path, fuzzed: Path, data: st.DataObject, file: Path
) -> None:
    (fuzzed / file).write_bytes(changed((whole / file).read_bytes(), data, file.suffix))
    house = fuzzed.parent.parent / "house"
    shutil.rmtree(house, ignore_errors=True)
    try:
        import_quietly(fuzzed, house)
        load_house(house)
    except InputError as error:
        assert str(fuzzed) in str(error)
        assert "\n" not in str(error)
        assert not house.exists()
    finally:
        shutil.copy(whole / file, fuzzed / file)


@settings(max_examples=60, deadline=None)
@given(data=st.data(), part=st.sampled_from(["matterport_mesh", "house_segmentations"]))
def test_no_archive_ends_in_a_traceback(
    whole: Path, tmp_path_factory: pytest.TempPathFactory, data: st.DataObject, part: str
) -> None:
    scan = tmp_path_factory.mktemp("zip") / "scans" / whole.name
    shutil.copytree(whole.parent, scan.parent)
    pack(scan)
    archive = scan / f"{part}.zip"
    archive.write_bytes(changed(archive.read_bytes(), data, ".zip"))
    try:
        import_quietly(scan, scan.parent / "house")
    except InputError as error:
        assert "\n" not in str(error)
        assert not (scan.parent / "house").exists()
