"""Small mesh files of other tools' making: y up, nested transforms, several textures."""

from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from PIL import Image
from trimesh.visual.material import PBRMaterial
from trimesh.visual.texture import TextureVisuals

from tests.source_room import picture

MIRRORED = 33648


def write_glb(path: Path) -> None:
    """A floor of 4×6 m, and an armchair whose node is moved, turned, mirrored and has a parent."""
    scene = trimesh.Scene()
    floor = _textured(trimesh.creation.box((4, 0.1, 6)), "floor", (1.0, 1.0, 1.0, 1.0))
    scene.add_geometry(floor, node_name="Ground")
    parent = trimesh.transformations.translation_matrix((1, 0, 0))
    scene.graph.update(frame_from="world", frame_to="Furniture", matrix=parent)
    seat = _textured(trimesh.creation.box((1, 2, 0.5)), "seat", (0.5, 1.0, 1.0, 0.5))
    turn = trimesh.transformations.rotation_matrix(np.pi / 2, (0, 1, 0), (0, 0, 0))
    turn[:3, 3] = 0, 1, 2
    pose = turn @ np.diag([-1.0, 1, 1, 1])
    scene.add_geometry(seat, node_name="ArmChair.001", parent_node_name="Furniture", transform=pose)
    path.write_bytes(trimesh.exchange.gltf.export_glb(scene, tree_postprocessor=_mirror_seats))


def write_obj(path: Path) -> None:
    """Two squares with a texture each, one clamped, and one without any; OBJ, MTL and PNG files."""
    for name in ("a", "b"):
        Image.fromarray(picture(name, 16, 24)).save(path.with_name(f"{name}.png"))
    path.with_name("looks.mtl").write_text(
        "newmtl red\nKd 0.9 0.1 0.1\n"
        "newmtl a\nKd 0.8 0.8 0.8\nmap_Kd a.png\n"
        "newmtl b\nmap_Kd -clamp on b.png\n"
    )
    lines = ["mtllib looks.mtl", "vt 0 0", "vt 2 0", "vt 2 1", "vt 0 1"]
    for z in range(3):
        lines += [f"v {x} {y} {z}" for x, y in ((0, 0), (2, 0), (2, 2), (0, 2))]
    for square, (thing, material) in enumerate((("sofa", "a"), ("sofa", "b"), ("wall", "red"))):
        first = 4 * square + 1
        lines += [f"o {thing}", f"usemtl {material}"]
        lines += [
            f"f {first}/1 {first + 1}/2 {first + 2}/3",
            f"f {first}/1 {first + 2}/3 {first + 3}/4",
        ]
    path.write_text("\n".join(lines) + "\n")


def write_ply(path: Path, size: tuple[float, float, float] = (2, 3, 2)) -> None:
    """A coloured box that stands on z = 0."""
    box = trimesh.creation.box(size)
    box.apply_translation((0, 0, size[2] / 2))
    box.visual.vertex_colors = np.arange(32).reshape(8, 4) * 8
    path.write_bytes(box.export(file_type="ply"))


def _textured(
    mesh: trimesh.Trimesh, name: str, factor: tuple[float, float, float, float]
) -> trimesh.Trimesh:
    material = PBRMaterial(
        name=name,
        baseColorTexture=Image.fromarray(picture(name, 20, 32)),
        baseColorFactor=factor,
    )
    uv = mesh.vertices[:, [0, 2]] * 0.5
    return trimesh.Trimesh(
        mesh.vertices, mesh.faces, visual=TextureVisuals(uv, material=material), process=False
    )


def _mirror_seats(tree: dict[str, Any]) -> None:
    tree["samplers"] = [{"wrapS": MIRRORED, "wrapT": MIRRORED}]
    seat = next(material for material in tree["materials"] if material["name"] == "seat")
    texture = seat["pbrMetallicRoughness"]["baseColorTexture"]["index"]
    tree["textures"][texture]["sampler"] = 0
