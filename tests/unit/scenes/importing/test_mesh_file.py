"""Mesh files of every kind become our world; broken ones are refused in one line."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.fuzz import refused_or_read, texts
from tests.mesh_files import write_glb, write_obj, write_ply
from tests.source_room import picture
from vlnhijack import display
from vlnhijack.errors import InputError
from vlnhijack.scenes.importing import memory
from vlnhijack.scenes.importing.gltf_header import _packed
from vlnhijack.scenes.importing.labels import label_by_file, label_by_name
from vlnhijack.scenes.importing.mesh_file import ReadOptions, read_mesh

WRITERS = {"glb": write_glb, "obj": write_obj, "ply": write_ply}


def written(folder: Path, kind: str) -> Path:
    path = folder / f"mesh.{kind}"
    WRITERS[kind](path)
    return path


def bounds(mesh, faces) -> np.ndarray:
    corners = mesh.vertices[mesh.faces[faces]].reshape(-1, 3)
    return np.array([corners.min(0), corners.max(0)])


def test_glb_nodes_stand_where_they_are(tmp_path) -> None:
    read = read_mesh(written(tmp_path, "glb"))
    names = [node[0] for node in read.nodes]
    floor, seat = (read.face_node == names.index(n) for n in ("Ground", "ArmChair.001"))
    assert "Furniture" in read.nodes[names.index("ArmChair.001")]
    assert np.allclose(bounds(read.mesh, floor), [[-2, -3, -0.05], [2, 3, 0.05]])
    # glTF (1, 1, 2) is our (1, -2, 1); the quarter turn about up swaps 1 and 0.5
    assert np.allclose(bounds(read.mesh, seat), [[0.75, -2.5, 0], [1.25, -1.5, 2]])
    solid = trimesh.Trimesh(read.mesh.vertices, read.mesh.faces[seat], process=False)
    assert np.isclose(solid.volume, 1), "faces look out, though the node is mirrored"


def test_glb_materials(tmp_path) -> None:
    read = read_mesh(written(tmp_path, "glb"))
    floor, seat = sorted(read.mesh.materials, key=lambda m: m.name)
    assert (floor.wrap, seat.wrap) == ("repeat", "mirror")
    assert np.array_equal(floor.image, picture("floor", 20, 32))
    wanted = display.decode(picture("seat", 20, 32) / 255) * [0.5, 1, 1]
    assert np.abs(seat.image / 255 - display.encode(wanted)).max() < 0.003
    assert any("alpha" in note for note in read.notes)


def test_a_texture_without_coordinates_is_its_mean(tmp_path) -> None:
    path = written(tmp_path, "obj")
    path.write_text(re.sub(r"/\d+", "", path.read_text()))
    read = read_mesh(path)
    looks = {m.name: m for m in read.mesh.materials}
    assert looks["a"].image is None
    assert np.allclose(looks["a"].colour, picture("a", 16, 24).mean((0, 1)) / 255)
    assert any("texture coordinates" in note for note in read.notes)


def test_gltf_beside_its_files(tmp_path) -> None:
    scene = trimesh.load_scene(written(tmp_path, "glb"))
    for name, content in scene.export(file_type="gltf").items():
        (tmp_path / name).write_bytes(content)
    one, other = read_mesh(tmp_path / "model.gltf").mesh, read_mesh(tmp_path / "mesh.glb").mesh
    assert np.allclose(np.sort(one.vertices, axis=0), np.sort(other.vertices, axis=0))


def test_obj_objects_materials_and_missing_files(tmp_path) -> None:
    path = written(tmp_path, "obj")
    read = read_mesh(path, ReadOptions(up="z"))
    looks = {m.name: m for m in read.mesh.materials}
    assert np.array_equal(looks["a"].image, picture("a", 16, 24))
    assert (looks["a"].wrap, looks["b"].wrap) == ("repeat", "clamp")
    assert looks["red"].colour == (0.9, 0.1, 0.1)
    mesh, _ = label_by_name(read)
    assert [thing.id for thing in mesh.objects] == ["sofa_00"]
    assert (mesh.face_object == 0).sum() == 4
    assert np.allclose(mesh.corner_uv[..., 1].max(), 1)
    (tmp_path / "b.png").write_bytes((tmp_path / "a.png").read_bytes()[:60])
    with pytest.raises(InputError, match=r"texture b\.png.*--allow-missing"):
        read_mesh(path)
    flat = read_mesh(path, ReadOptions(allow_missing=True))
    assert any("b.png" in note for note in flat.notes)
    (tmp_path / "looks.mtl").unlink()
    with pytest.raises(InputError, match=r"looks\.mtl"):
        read_mesh(path)


def test_ply_colours(tmp_path) -> None:
    mesh = read_mesh(written(tmp_path, "ply")).mesh
    assert mesh.vertex_colours is not None
    assert np.array_equal(np.unique(mesh.vertex_colours[:, 0]), np.arange(0, 256, 32))
    assert np.isclose(np.ptp(mesh.vertices[:, 1]), 3), "PLY is z up"


def test_ply_colours_of_faces(tmp_path) -> None:
    box = trimesh.creation.box((2, 3, 2))
    box.visual.face_colors = [(20 * face, 0, 0, 255) for face in range(12)]
    (tmp_path / "faces.ply").write_bytes(box.export(file_type="ply"))
    mesh = read_mesh(tmp_path / "faces.ply").mesh
    assert mesh.vertex_colours is not None
    corners = mesh.vertex_colours[mesh.faces]
    assert np.array_equal(corners[..., 0], np.repeat(20 * np.arange(12)[:, None], 3, 1))
    assert not corners[..., 1:].any()


def test_specular_glossiness_is_refused(tmp_path) -> None:
    scene = trimesh.load_scene(written(tmp_path, "glb"))
    for name, content in scene.export(file_type="gltf").items():
        (tmp_path / name).write_bytes(content)
    tree = json.loads((tmp_path / "model.gltf").read_text())
    del tree["materials"][0]["pbrMetallicRoughness"]
    look = {"diffuseFactor": [1, 0, 0, 1]}
    tree["materials"][0]["extensions"] = {"KHR_materials_pbrSpecularGlossiness": look}
    (tmp_path / "model.gltf").write_text(json.dumps(tree))
    with pytest.raises(InputError, match="materials: expected metallic-roughness materials"):
        read_mesh(tmp_path / "model.gltf")


def test_units(tmp_path) -> None:
    path = written(tmp_path, "ply")
    with pytest.raises(InputError, match=r"--scale 0\.001"):
        read_mesh(path, ReadOptions(scale=1000))
    assert np.isclose(np.ptp(read_mesh(path, ReadOptions(scale=10)).mesh.vertices[:, 1]), 30)


@pytest.mark.parametrize("kind", ["glb", "ply"])
def test_truncated_files_are_refused(tmp_path, kind: str) -> None:
    path = written(tmp_path, kind)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) * 3 // 4])
    with pytest.raises(InputError, match=str(path)):
        read_mesh(path)


def test_more_than_the_memory_is_refused(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(memory, "_available", lambda: 1000)
    with pytest.raises(InputError, match="GB"):
        read_mesh(written(tmp_path, "ply"))


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"matrix": [float("nan")] * 16}, "nodes.*matrix"),
        ({"translation": [0, float("inf"), 0]}, "nodes.*translation"),
        ({"mesh": 999}, "meshes: expected indices below"),
        ({"children": [999]}, "nodes: expected indices below"),
        ({"children": [0]}, "nodes: expected trees"),
    ],
)
def test_nodes_that_make_no_scene_are_refused(tmp_path, change: dict, field: str) -> None:
    file = tmp_path / "a.glb"
    write_glb(file)
    content = file.read_bytes()
    length = int.from_bytes(content[12:16], "little")
    tree = json.loads(content[20 : 20 + length])
    node = tree["nodes"][0]
    (node.pop("matrix", None), node.update(change))
    file.write_bytes(_packed(tree, content[20 + length :]))
    with pytest.raises(InputError, match=field):
        read_mesh(file)


def test_labels_of_a_file(tmp_path) -> None:
    read = read_mesh(written(tmp_path, "obj"), ReadOptions(up="z"))
    labels = tmp_path / "labels.json"
    labels.write_text(
        '{"rooms": [{"id": "r", "label": "office", "bounds": [0, 0, 2, 2]}], "objects": ['
        '{"id": "tv", "category": "tv_monitor", "node": "sofa", "faces": [[0, 2]]}]}'
    )
    mesh, rooms = label_by_file(read, labels)
    assert rooms[0].label == "office"
    assert mesh.objects[0].room == "r"
    assert (mesh.face_object == 0).sum() == 2
    labels.write_text('{"objects": [{"id": "tv", "category": "tv_monitor", "node": "sofas"}]}')
    with pytest.raises(InputError, match="object tv: node"):
        label_by_file(read, labels)


LABELS = {
    "rooms": [{"id": "r", "label": "office", "bounds": [0, 0, 2, 2]}],
    "objects": [{"id": "tv", "category": "tv_monitor", "room": "r", "faces": [[0, 2], [3, 5]]}],
}


@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(content=texts(LABELS))
def test_broken_labels_are_refused_in_one_line(tmp_path, content: bytes) -> None:
    read = read_mesh(written(tmp_path, "ply"))
    refused_or_read(tmp_path / "labels.json", content, lambda file: label_by_file(read, file))


@pytest.mark.parametrize("kind", ["glb", "obj", "ply"])
@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_broken_files_are_refused_in_one_line(tmp_path, kind: str, data) -> None:
    content = bytearray(written(tmp_path, kind).read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(content) - 1))
        content[at : at + data.draw(st.integers(0, 8))] = data.draw(st.binary(max_size=8))
    end = data.draw(st.sampled_from([len(content), data.draw(st.integers(0, len(content)))]))
    refused_or_read(tmp_path / f"broken.{kind}", bytes(content[:end]), read_mesh)
