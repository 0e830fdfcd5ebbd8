"""The glTF file holds the same surfaces, y up, with their uv and unlit materials."""

import json
import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh

from tests.houses import tiny_house
from vlnhijack import display
from vlnhijack.frames import z_up_to_y_up
from vlnhijack.scenes.gltf import save_glb


def test_reloading_gives_the_surfaces(tmp_path: Path) -> None:
    house = tiny_house()
    save_glb(house, tmp_path / "scene.glb")
    scene = trimesh.load_scene(tmp_path / "scene.glb")
    assert set(scene.graph.nodes_geometry) == {s.name for s in house.surfaces}
    for surface in house.surfaces:
        mesh = scene.geometry[surface.name]
        assert np.allclose(mesh.vertices, z_up_to_y_up(surface.vertices), atol=1e-6)
        assert np.array_equal(mesh.faces, surface.faces)
        assert np.allclose(mesh.visual.uv * [1, -1] + [0, 1], surface.uv, atol=1e-6)
        image = np.asarray(mesh.visual.material.baseColorTexture).astype(int)
        assert np.abs(image - display.to_8bit(surface.texture)).mean() < 8


@pytest.mark.parametrize("kind, unlit", [("baked", True), ("lit", False)])
def test_uv_in_the_file_is_top_left_and_only_baked_is_unlit(tmp_path, kind, unlit) -> None:  # type: ignore[no-untyped-def]
    house = tiny_house(kind)
    save_glb(house, tmp_path / "scene.glb")
    content = (tmp_path / "scene.glb").read_bytes()
    (length,) = struct.unpack_from("<I", content, 12)
    tree, blob = json.loads(content[20 : 20 + length]), content[28 + length :]
    assert ("KHR_materials_unlit" in tree.get("extensionsUsed", [])) == unlit
    assert all(("extensions" in material) == unlit for material in tree["materials"])
    primitive = tree["meshes"][0]["primitives"][0]
    accessor = tree["accessors"][primitive["attributes"]["TEXCOORD_0"]]
    view = tree["bufferViews"][accessor["bufferView"]]
    uv = np.frombuffer(blob, "<f4", accessor["count"] * 2, view.get("byteOffset", 0))
    assert np.allclose(uv.reshape(-1, 2), house.surfaces[0].uv, atol=1e-6)
