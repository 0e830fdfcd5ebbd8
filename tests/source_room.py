"""A small furnished room as a source mesh, and a direct render of any source mesh."""

from collections.abc import Sequence

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates
from trimesh.ray.ray_pyembree import RayMeshIntersector

from vlnhijack.frames import Camera, camera_to_world
from vlnhijack.navigation.graph import NavigationGraph
from vlnhijack.scenes.house import Room
from vlnhijack.scenes.importing.source_mesh import BACKGROUND, Material, SourceMesh, SourceObject
from vlnhijack.seeds import stream

ROOM = Room("room_0", "room", (0.0, 0.0, 4.0, 3.0))
_BEYOND = {"clamp": "nearest", "repeat": "grid-wrap", "mirror": "reflect"}


def picture(name: str, height: int, width: int) -> NDArray[np.uint8]:
    """A smooth random image."""
    noise = gaussian_filter(stream(0, name).normal(size=(height, width, 3)), (1.5, 1.5, 0))
    return np.clip(127 + 300 * noise, 0, 255).astype(np.uint8)


def furnished_room(colours: bool = False) -> SourceMesh:
    """A room of 4×3×2.5 m seen from inside, a box of two materials and a ball without texture."""
    box = trimesh.creation.box((0.8, 0.6, 0.7), _moved(1.0, 1.0, 0.35))
    ball = trimesh.creation.icosphere(2, 0.4)
    ball.apply_translation((3.0, 2.0, 0.4))
    shell = trimesh.creation.box((4, 3, 2.5), _moved(2, 1.5, 1.25))
    shell.invert()
    meshes = [shell, box, ball]
    corner_uv = [_box_uv(shell, 0.7), _box_uv(box, 1.3), np.zeros((len(ball.faces), 3, 2))]
    materials = (
        Material("wall", picture("wall", 96, 128), wrap="repeat"),
        Material("floor", picture("floor", 64, 64), wrap="mirror"),
        Material("wood", picture("wood", 100, 60), wrap="clamp"),
        Material("red", colour=(0.8, 0.2, 0.2)),
    )
    up = np.abs(shell.face_normals[:, 2]) > 0.5
    on_top = box.face_normals[:, 2] > 0.5
    look = [np.where(up, 1, 0), np.where(on_top, 3, 2), np.full(len(ball.faces), 3)]
    starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    vertices = np.concatenate([mesh.vertices for mesh in meshes])
    shades = stream(0, "shades").integers(60, 256, (len(vertices), 3)).astype(np.uint8)
    return SourceMesh(
        file="room.glb",
        vertices=np.asarray(vertices, np.float64),
        faces=np.concatenate(
            [mesh.faces + start for mesh, start in zip(meshes, starts, strict=False)]
        ).astype(np.int32),
        corner_uv=np.concatenate(corner_uv).astype(np.float32),
        vertex_colours=shades if colours else None,
        face_material=np.concatenate(look).astype(np.int32),
        materials=materials,
        face_object=np.repeat([BACKGROUND, 0, 1], [len(m.faces) for m in meshes]).astype(np.int32),
        objects=(
            SourceObject("table_0", "table", "room_0"),
            SourceObject("ball", "lamp", "room_0"),
        ),
    )


def line_graph(name: str) -> NavigationGraph:
    """Three viewpoints in a row through the room."""
    positions = np.array([[0.5, 2.3, 1.5], [2.0, 2.2, 1.5], [3.3, 0.8, 1.5]])
    step = np.eye(3, k=1, dtype=bool)
    return NavigationGraph(name, ("a", "b", "c"), positions, step | step.T, np.full(3, 1.5))


def direct_render(
    source: SourceMesh, cameras: Sequence[Camera], samples: int = 4
) -> NDArray[np.float32]:
    """Images (V,3,h,w) of the mesh with the images of its materials, samples² rays a pixel."""
    mesh = trimesh.Trimesh(source.vertices, source.faces, process=False)
    scene = RayMeshIntersector(mesh)
    return np.stack([_view(source, mesh, scene, camera, samples) for camera in cameras])


def psnr(one: NDArray[np.floating], other: NDArray[np.floating]) -> float:
    """Peak signal-to-noise ratio in dB of images in [0,1]."""
    return float(-10 * np.log10(np.mean((np.asarray(one) - np.asarray(other)) ** 2)))


def _view(
    source: SourceMesh,
    mesh: trimesh.Trimesh,
    scene: RayMeshIntersector,
    camera: Camera,
    samples: int,
) -> NDArray[np.float32]:
    height, width = camera.height * samples, camera.width * samples
    half = np.tan(camera.vertical_fov / 2) / height
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    plane = np.stack([(width - 2 * x) * half, (height - 2 * y) * half, np.ones_like(x)], -1)
    rays = plane.reshape(-1, 3) @ camera_to_world(camera)[:3, :3].T
    origins = np.broadcast_to(np.array(camera.position), rays.shape)
    face = scene.intersects_first(origins, rays)
    colours = np.zeros((len(rays), 3))
    seen = face >= 0
    colours[seen] = _shade(source, mesh, face[seen], origins[seen], rays[seen])
    image = colours.reshape(camera.height, samples, camera.width, samples, 3).mean((1, 3))
    return image.transpose(2, 0, 1).astype(np.float32)


def _shade(
    source: SourceMesh,
    mesh: trimesh.Trimesh,
    face: NDArray[np.int64],
    origins: NDArray[np.float64],
    rays: NDArray[np.float64],
) -> NDArray[np.float64]:
    corners, normal = mesh.triangles[face], mesh.face_normals[face]
    facing = (rays * normal).sum(1)
    reach = ((corners[:, 0] - origins) * normal).sum(1) / facing
    points = origins + reach[:, None] * rays
    weights = trimesh.triangles.points_to_barycentric(corners, points)
    uv = np.einsum("kc,kcd->kd", weights, source.corner_uv[face])
    colours = np.zeros((len(face), 3))
    for index, material in enumerate(source.materials):
        mine = source.face_material[face] == index
        if material.image is None:
            colours[mine] = material.colour
            continue
        h, w, _ = material.image.shape
        at = np.stack([uv[mine, 1] * h - 0.5, uv[mine, 0] * w - 0.5])
        for channel in range(3):
            plane = material.image[..., channel] / 255.0
            colours[mine, channel] = map_coordinates(
                plane, at, order=1, mode=_BEYOND[material.wrap]
            )
    if source.vertex_colours is not None:
        shades = source.vertex_colours[source.faces[face]] / 255.0
        colours *= np.einsum("kc,kcd->kd", weights, shades)
    return np.where(facing[:, None] < 0, colours, 0.0)


def _moved(x: float, y: float, z: float) -> NDArray[np.float64]:
    return trimesh.transformations.translation_matrix((x, y, z))


def _box_uv(mesh: trimesh.Trimesh, scale: float) -> NDArray[np.float64]:
    """Each face projected along its normal's axis, `scale` repetitions a metre."""
    axis = np.abs(mesh.face_normals).argmax(axis=1)
    others = np.array([[1, 2], [0, 2], [0, 1]])[axis]
    return scale * np.take_along_axis(mesh.triangles, others[:, None, :], axis=2)
