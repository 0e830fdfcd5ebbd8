"""Panoramas of a scan: six square images of a viewpoint, and MatterSim's views of them.

The images look up, ahead, to the right, back, to the left and down. A viewpoint's pose turns their
axes to the world: x to the left, y down, z back from what lies ahead. MatterSim halves them (512²,
`<viewpoint>_skybox_small.jpg`) and looks each pixel up in an OpenGL cube map: linear filter, each
image clamped at its borders, 8 bits (Matterport3DSimulator, src/lib/MatterSim.cpp, NavGraph.cpp).
"""

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from vlnhijack.errors import InputError
from vlnhijack.frames import Camera, camera_to_world
from vlnhijack.scenes.matterport.archive import read_members

Images = NDArray[np.uint8]

PART = "matterport_skybox_images"
SIDES = 6
EDGE = 512
# Of each image: axes of the pose ahead, to the right and down, and their signs.
_FACES = ((1, 0, 2), (2, 0, 1), (0, 2, 1), (2, 0, 1), (0, 2, 1), (1, 0, 2))
_SIGNS = ((-1, -1, -1), (-1, -1, 1), (-1, 1, 1), (1, 1, 1), (1, -1, 1), (1, -1, 1))


def read_skybox(scan: Path, viewpoint: str) -> Images:
    """The six images (6,512,512,3) of a viewpoint of a scan's folder, as MatterSim has them.

    `<viewpoint>_skybox_small.jpg` or six `<viewpoint>_skybox<k>_sami.jpg`, in
    `matterport_skybox_images` or its .zip. Raises InputError where they are missing or broken.
    """
    small = f"{viewpoint}_skybox_small.jpg"
    names = [f"{viewpoint}_skybox{side}_sami.jpg" for side in range(SIDES)]
    content = _contents(scan, [small, *names])
    if small in content:
        strip = _decoded(scan / PART / small, content[small], sides=SIDES)
        return np.stack(np.split(strip, SIDES, axis=1))
    for name in names:
        if name not in content:
            raise InputError(
                file=scan / PART, expected=f"{small} or {name}", received="neither of them"
            )
    images = [_decoded(scan / PART / name, content[name], sides=1) for name in names]
    if len({image.shape for image in images}) > 1:
        sizes = [len(image) for image in images]
        raise InputError(file=scan / PART / names[0], expected="six of one size", received=sizes)
    return np.stack(images)


def skybox_view(images: Images, rotation: NDArray[np.float64], camera: Camera) -> Images:
    """The picture (h,w,3) that MatterSim shows of images (6,N,N,3).

    rotation (3,3) of the viewpoint's pose; the camera's position plays no part.
    """
    look = _directions(camera) @ rotation
    side = _side(look)
    shown = np.empty((*side.shape, 3), np.uint8)
    for number in range(SIDES):
        here = side == number
        if here.any():
            shown[here] = _look_up(images[number], _position(look[here], number))
    return shown


def _directions(camera: Camera) -> NDArray[np.float64]:
    """World directions (h,w,3) through the centres of the pixels."""
    half = np.tan(camera.vertical_fov / 2)
    x = (np.arange(camera.width) + 0.5) * 2 / camera.width - 1
    y = 1 - (np.arange(camera.height) + 0.5) * 2 / camera.height
    left, up, forward = camera_to_world(camera)[:3, :3].T
    across = -left * (half * camera.width / camera.height * x)[None, :, None]
    return np.asarray(across + up * (half * y)[:, None, None] + forward)


def _side(look: NDArray[np.float64]) -> NDArray[np.int64]:
    """The image (…) that directions (…,3) in the pose's axes meet."""
    ahead = [sign[0] * look[..., face[0]] for face, sign in zip(_FACES, _SIGNS, strict=True)]
    return np.stack(ahead, -1).argmax(-1)


def _position(look: NDArray[np.float64], side: int) -> NDArray[np.float64]:
    """Positions (K,2) in [-1,1], to the right and down, of directions (K,3) on an image."""
    ahead, right, down = (
        sign * look[:, axis] for sign, axis in zip(_SIGNS[side], _FACES[side], strict=True)
    )
    return np.stack([right / ahead, down / ahead], 1)


def _look_up(image: Images, position: NDArray[np.float64]) -> Images:
    edge = len(image)
    at = ((position + 1) / 2 * edge - 0.5).clip(0, edge - 1)
    low = at.astype(np.int64)
    high = np.minimum(low + 1, edge - 1)
    x, y = (at - low).T[..., None]
    top = (1 - x) * image[low[:, 1], low[:, 0]] + x * image[low[:, 1], high[:, 0]]
    bottom = (1 - x) * image[high[:, 1], low[:, 0]] + x * image[high[:, 1], high[:, 0]]
    return np.asarray(np.round((1 - y) * top + y * bottom), np.uint8)


def _contents(scan: Path, names: Sequence[str]) -> dict[str, bytes]:
    """The files of these names that the folder or its archive has."""
    folder, archive = scan / PART, scan / f"{PART}.zip"
    if folder.is_dir():
        paths = {path.name: path for path in folder.rglob("*.jpg")}
        return {name: paths[name].read_bytes() for name in names if name in paths}
    if not archive.is_file():
        raise InputError(file=scan, expected=f"{PART} or {PART}.zip", received="neither of them")
    return read_members(archive, names)


def _decoded(file: Path, content: bytes, *, sides: int) -> Images:
    """The pixels (N, sides·N, 3) of a JPEG of `sides` squares side by side, at most 512² large."""
    expected = f"an image of {sides} × 1 squares"
    try:
        with Image.open(io.BytesIO(content)) as image:
            width, height = image.size
            if width != sides * height:
                received = f"{width} × {height} pixels"
                raise InputError(file=file, expected=expected, received=received)
            edge = min(height, EDGE)
            small = image.convert("RGB").resize((sides * edge, edge), Image.Resampling.BOX)
            return np.asarray(small)
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise InputError(file=file, expected=expected, received=error) from None
