"""Write docs/examples/apartment.glb: a flat as a modelling tool would, made with trimesh alone.

y up, metres, nested nodes with transforms, a mirrored node, repeated textures, plain colours.
"""

from pathlib import Path

import numpy as np
import trimesh
from PIL import Image
from trimesh.transformations import rotation_matrix, translation_matrix
from trimesh.visual.material import PBRMaterial
from trimesh.visual.texture import TextureVisuals

OUT = Path(__file__).parents[1] / "docs" / "examples" / "apartment.glb"
HEIGHT, WALL, DOOR = 2.6, 0.12, 1.1
Box = tuple[float, float, float, float, float, float]


def noise(rng: np.random.Generator, size: int, grain: tuple[int, int]) -> np.ndarray:
    """A periodic random pattern in [0,1]."""
    coarse = rng.random((size // grain[0], size // grain[1]))
    image = Image.fromarray((255 * np.kron(coarse, np.ones(grain))).astype(np.uint8))
    return np.asarray(image, float) / 255


def picture(name: str) -> Image.Image:
    rng = np.random.default_rng(sum(name.encode()))
    size = 128
    row, column = np.mgrid[:size, :size] / size
    if name == "boards":
        value = 0.7 + 0.2 * noise(rng, size, (16, 64)) + 0.1 * noise(rng, size, (2, 16))
        value *= np.where(np.mod(row * 8, 1) < 0.06, 0.6, 1)
        tone = (0.72, 0.52, 0.34)
    elif name == "plaster":
        value, tone = 0.92 + 0.06 * noise(rng, size, (4, 4)), (0.90, 0.87, 0.80)
    elif name == "fabric":
        value = 0.7 + 0.2 * noise(rng, size, (2, 2)) + 0.1 * (np.mod(column * 16, 1) < 0.5)
        tone = (0.35, 0.42, 0.62)
    elif name == "wood":
        value = 0.75 + 0.25 * noise(rng, size, (4, 32))
        tone = (0.45, 0.28, 0.16)
    elif name == "screen":
        value = 0.3 + 0.5 * np.sin(9 * column + 5 * row) ** 2
        tone = (0.25, 0.45, 0.85)
    else:
        value, tone = 0.6 + 0.4 * noise(rng, size, (8, 8)), (0.20, 0.50, 0.18)
    image = np.clip(value[..., None] * tone, 0, 1)
    return Image.fromarray((255 * image).astype(np.uint8))


LOOKS = {
    name: PBRMaterial(name=name, baseColorTexture=picture(name), roughnessFactor=1.0)
    for name in ("boards", "plaster", "fabric", "wood", "screen", "leaves")
}
LOOKS |= {
    "white": PBRMaterial(name="white", baseColorFactor=(0.9, 0.9, 0.9, 1.0)),
    "black": PBRMaterial(name="black", baseColorFactor=(0.02, 0.02, 0.02, 1.0)),
    "clay": PBRMaterial(name="clay", baseColorFactor=(0.5, 0.16, 0.07, 1.0)),
}


def part(look: str, box: Box, repeats: float = 1.0) -> trimesh.Trimesh:
    """A box x, y, z (centre) and sizes, its sides textured `repeats` times a metre."""
    mesh = trimesh.creation.box(box[3:])
    mesh.unmerge_vertices()
    mesh.apply_translation(box[:3])
    axis = np.abs(mesh.face_normals).argmax(axis=1)
    others = np.array([[2, 1], [0, 2], [0, 1]])[axis]
    uv = np.take_along_axis(mesh.triangles, others[:, None, :], axis=2).reshape(-1, 2)
    visual = TextureVisuals(uv * repeats, material=LOOKS[look])
    return trimesh.Trimesh(mesh.vertices, mesh.faces, visual=visual, process=False)


def legs(look: str, width: float, depth: float, height: float) -> list[trimesh.Trimesh]:
    x, z = width / 2 - 0.05, depth / 2 - 0.05
    return [
        part(look, (i * x, height / 2, j * z, 0.06, height, 0.06)) for i in (-1, 1) for j in (-1, 1)
    ]


# Each stands on y = 0 and faces +z.
FURNITURE = {
    "Sofa": [
        part("fabric", (0, 0.22, 0, 1.9, 0.44, 0.85), 2),
        part("fabric", (0, 0.62, -0.33, 1.9, 0.45, 0.2), 2),
        part("fabric", (-0.86, 0.52, 0, 0.18, 0.25, 0.85), 2),
        part("fabric", (0.86, 0.52, 0, 0.18, 0.25, 0.85), 2),
    ],
    "Chair": [
        part("wood", (0, 0.45, 0, 0.46, 0.05, 0.46)),
        part("wood", (0, 0.72, -0.21, 0.46, 0.5, 0.04)),
        *legs("wood", 0.46, 0.46, 0.43),
    ],
    "Table": [part("wood", (0, 0.74, 0, 1.4, 0.05, 0.8)), *legs("wood", 1.4, 0.8, 0.72)],
    "Cabinet": [
        part("wood", (0, 0.6, 0, 1.0, 1.2, 0.45)),
        part("white", (-0.25, 0.6, 0.23, 0.44, 1.1, 0.02)),
        part("white", (0.25, 0.6, 0.23, 0.44, 1.1, 0.02)),
    ],
    "TV": [
        part("black", (0, 0.95, 0, 1.2, 0.72, 0.06)),
        part("screen", (0, 0.95, 0.035, 1.12, 0.64, 0.01)),
        part("black", (0, 0.3, 0, 0.5, 0.6, 0.3)),
    ],
    "Bed": [
        part("wood", (0, 0.15, 0, 1.6, 0.3, 2.0)),
        part("white", (0, 0.4, 0, 1.55, 0.2, 1.95)),
        part("fabric", (0, 0.52, 0.3, 1.58, 0.05, 1.3)),
        part("wood", (0, 0.5, -1.0, 1.6, 1.0, 0.06)),
    ],
    "Plant": [
        part("clay", (0, 0.2, 0, 0.35, 0.4, 0.35)),
        part("leaves", (0, 0.8, 0, 0.6, 0.8, 0.08)),
        part("leaves", (0, 0.8, 0, 0.08, 0.8, 0.6)),
        part("leaves", (0, 1.05, 0, 0.4, 0.5, 0.4)),
    ],
    "Lamp": [
        part("black", (0, 0.02, 0, 0.3, 0.04, 0.3)),
        part("black", (0, 0.75, 0, 0.04, 1.5, 0.04)),
        part("white", (0, 1.5, 0, 0.36, 0.3, 0.36)),
    ],
}

# Name, x and z on the floor, and the heading in degrees about the upward axis.
PLACES = [
    ("Sofa.001", 1.3, 5.5, 180), ("TV.001", 1.6, 0.5, 0), ("Plant.001", 0.5, 0.5, 0),
    ("Lamp.001", 4.1, 5.5, 0), ("Cabinet.001", 0.35, 3.0, 90), ("Chair.001", 4.6, 3.4, 270),
    ("Table.001", 7.6, 2.0, 0), ("Chair.002", 7.2, 2.8, 180), ("Chair.003", 8.0, 1.2, 0),
    ("Cabinet.002", 9.6, 3.3, 270), ("Plant.002", 9.4, 0.5, 0), ("Bed.001", 1.3, 8.2, 90),
    ("Cabinet.003", 3.2, 9.6, 180), ("Lamp.002", 0.5, 6.8, 0), ("Plant.003", 4.4, 9.4, 0),
    ("Sofa.002", 9.3, 7.4, 270), ("TV.002", 6.2, 4.6, 0), ("Chair.004", 7.6, 9.4, 180),
    ("Table.002", 7.9, 7.2, 90), ("Cabinet.004", 6.2, 9.6, 180),
]  # fmt: skip

# Walls from (x0, z0) to (x1, z1); gaps are doorways.
WALLS = [
    (0, 0, 10, 0), (0, 0, 0, 10), (10, 0, 10, 10), (0, 10, 10, 10),
    (5.2, 0, 5.2, 1.6), (5.2, 2.7, 5.2, 7.0), (5.2, 8.1, 5.2, 10),
    (0, 6.2, 2.6, 6.2), (3.7, 6.2, 5.2, 6.2),
    (5.2, 4.2, 7.0, 4.2), (8.1, 4.2, 10, 4.2),
]  # fmt: skip


def wall(x0: float, z0: float, x1: float, z1: float) -> trimesh.Trimesh:
    size = (x1 - x0 + WALL, HEIGHT, z1 - z0 + WALL)
    return part("plaster", ((x0 + x1) / 2, HEIGHT / 2, (z0 + z1) / 2, *size), 0.7)


def apartment() -> trimesh.Scene:
    scene = trimesh.Scene()
    scene.graph.update(frame_from="world", frame_to="Structure", matrix=np.eye(4))
    scene.graph.update(
        frame_from="world", frame_to="Furnishing", matrix=translation_matrix((5, 0, 5))
    )
    floor = part("boards", (5, -0.05, 5, 10.1, 0.1, 10.1), 0.8)
    ceiling = part("white", (5, HEIGHT + 0.05, 5, 10.1, 0.1, 10.1))
    shell = {"Floor": floor, "Ceiling": ceiling}
    shell |= {f"Wall.{row:03d}": wall(*ends) for row, ends in enumerate(WALLS)}
    for name, mesh in shell.items():
        scene.add_geometry(mesh, node_name=name, geom_name=name, parent_node_name="Structure")
    for name, x, z, degrees in PLACES:
        pose = translation_matrix((x - 5, 0, z - 5)) @ rotation_matrix(
            np.deg2rad(degrees), (0, 1, 0)
        )
        if name.endswith("2"):
            pose = pose @ np.diag([-1.0, 1, 1, 1])
        scene.graph.update(frame_from="Furnishing", frame_to=name, matrix=pose)
        for row, mesh in enumerate(FURNITURE[name.split(".")[0]]):
            label = f"{name}_part{row}"
            scene.add_geometry(mesh, node_name=label, geom_name=label, parent_node_name=name)
    return scene


if __name__ == "__main__":
    OUT.parent.mkdir(parents=True, exist_ok=True)
    OUT.write_bytes(trimesh.exchange.gltf.export_glb(apartment(), include_normals=False))
