"""Views of a skybox against MatterSim's OpenGL, step by step, and against what they show."""

import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from scipy.spatial.transform import Rotation

from vlnhijack import seeds
from vlnhijack.errors import InputError
from vlnhijack.frames import Camera, direction, heading_of
from vlnhijack.navigation.graph import UPRIGHT
from vlnhijack.navigation.views import panorama_cameras
from vlnhijack.scenes.matterport.skybox import read_skybox, skybox_view

IMAGES = seeds.stream(0, "skybox").integers(0, 256, (6, 16, 16, 3)).astype(np.uint8)
GL_FACES = {"+x": 2, "-x": 4, "+y": 0, "-y": 5, "+z": 1, "-z": 3}


def turn_x(angle: float) -> np.ndarray:
    return Rotation.from_euler("x", angle).as_matrix()


def turn_z(angle: float) -> np.ndarray:
    return Rotation.from_euler("z", angle).as_matrix()


def mattersim_pixel(rotation: np.ndarray, camera: Camera, row: int, column: int) -> np.ndarray:
    """One pixel as MatterSim's C++ and OpenGL 2's cube maps make it; row 0 is GL's lowest."""
    view = turn_x(-np.pi / 2 + camera.elevation) @ turn_z(np.pi + camera.heading)
    high = np.tan(camera.vertical_fov / 2)
    wide = high * camera.width / camera.height
    clip = [2 * (column + 0.5) / camera.width - 1, 2 * (row + 0.5) / camera.height - 1]
    x, y, z = np.linalg.inv(view @ rotation) @ [clip[0] * wide, clip[1] * high, -1.0]
    major = max(("x", x), ("y", y), ("z", z), key=lambda axis: abs(axis[1]))
    name = ("+" if major[1] > 0 else "-") + major[0]
    s, t = {
        "+x": (-z, -y), "-x": (z, -y), "+y": (x, z), "-y": (x, -z), "+z": (x, -y), "-z": (-x, -y),
    }[name]  # fmt: skip
    image = IMAGES[GL_FACES[name]].astype(float)
    edge = len(image)
    u, v = ((c / abs(major[1]) + 1) / 2 * edge - 0.5 for c in (s, t))
    i, j = int(np.floor(u)), int(np.floor(v))
    shown = np.zeros(3)
    for a, b in ((0, 0), (0, 1), (1, 0), (1, 1)):
        weight = (1 - abs(u - i - a)) * (1 - abs(v - j - b))
        shown += weight * image[min(max(j + b, 0), edge - 1), min(max(i + a, 0), edge - 1)]
    return shown


@pytest.mark.parametrize("seed", range(3))
def test_every_view_is_mattersims(seed: int) -> None:
    random = seeds.stream(seed, "poses")
    rotation = Rotation.random(random_state=np.random.RandomState(seed)).as_matrix()
    for camera in panorama_cameras((0, 0, 0), 8, 6):
        ours = skybox_view(IMAGES, rotation, camera).astype(float)
        for row, column in random.integers(0, (6, 8), (6, 2)):
            expected = mattersim_pixel(rotation, camera, row, column)
            assert np.abs(ours[row, column] - expected).max() <= 0.5 + 1e-6


def test_a_horizontal_panorama_turns_clockwise() -> None:
    """Upright, image 1 looks along +y and image 2 to the east of it; 0 is above, 5 below."""
    colours = np.broadcast_to(np.arange(6, dtype=np.uint8)[:, None, None, None], (6, 8, 8, 3))
    cameras = panorama_cameras((0, 0, 0), 9, 7)
    centre = [int(skybox_view(colours, UPRIGHT, camera)[3, 4, 0]) for camera in cameras]
    for camera, side in zip(cameras, centre, strict=True):
        ahead = direction(camera.heading, camera.elevation)
        quarter = round(float(heading_of(ahead)) / (np.pi / 2)) % 4
        assert side == 1 + quarter
    up, down = (Camera((0, 0, 0), 0.3, sign * 1.4, 9, 7) for sign in (1, -1))
    assert skybox_view(colours, UPRIGHT, up)[3, 4, 0] == 0
    assert skybox_view(colours, UPRIGHT, down)[3, 4, 0] == 5


def save(folder: Path, *, small: bool) -> None:
    folder.mkdir(parents=True)
    flat = (
        np.full((6, 1024, 1024, 3), 9, np.uint8)
        * np.arange(1, 7, dtype=np.uint8)[:, None, None, None]
    )
    if small:
        Image.fromarray(np.hstack(flat[:, ::2, ::2])).save(folder / "aa_skybox_small.jpg")
    else:
        for side in range(6):
            Image.fromarray(flat[side]).save(folder / f"aa_skybox{side}_sami.jpg")


@pytest.mark.parametrize("small", [False, True])
@pytest.mark.parametrize("packed", [False, True])
def test_files_are_read(tmp_path: Path, small: bool, packed: bool) -> None:
    folder = tmp_path / "scan" / "matterport_skybox_images"
    save(folder, small=small)
    scan = tmp_path / "scan"
    if packed:
        scan = tmp_path
        with zipfile.ZipFile(scan / "matterport_skybox_images.zip", "w") as archive:
            for file in folder.iterdir():
                archive.write(file, file.relative_to(tmp_path))
    images = read_skybox(scan, "aa")
    assert images.shape == (6, 512, 512, 3)
    assert np.abs(images.mean((1, 2, 3)) - 9 * np.arange(1, 7)).max() < 2
    with pytest.raises(InputError, match="bb_skybox_small.jpg or bb_skybox0_sami.jpg"):
        read_skybox(scan, "bb")


def test_what_is_no_skybox_is_refused(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match="matterport_skybox_images or matterport_skybox_images.zip"
    ):
        read_skybox(tmp_path, "aa")
    save(tmp_path / "matterport_skybox_images", small=False)
    file = tmp_path / "matterport_skybox_images" / "aa_skybox3_sami.jpg"
    Image.new("RGB", (20, 30)).save(file)
    with pytest.raises(InputError, match=r"aa_skybox3_sami.jpg: .*squares, received '20 × 30"):
        read_skybox(tmp_path, "aa")
    Image.new("RGB", (20, 20)).save(file)
    with pytest.raises(InputError, match="six of one size"):
        read_skybox(tmp_path, "aa")


@pytest.fixture(scope="module")
def strip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scan") / "matterport_skybox_images"
    folder.mkdir()
    Image.fromarray(np.hstack(IMAGES)).save(folder / "aa_skybox_small.jpg")
    return folder / "aa_skybox_small.jpg"


@settings(max_examples=100, deadline=None)
@given(st.data())
def test_no_image_ends_in_a_traceback(strip: Path, data: st.DataObject) -> None:
    whole = strip.with_suffix(".whole")
    if not whole.exists():
        whole.write_bytes(strip.read_bytes())
    content = whole.read_bytes()
    at = data.draw(st.integers(0, len(content)))
    junk = data.draw(st.binary(max_size=8))
    rest = data.draw(st.booleans())
    strip.write_bytes(content[:at] + junk + (content[at + len(junk) :] if rest else b""))
    try:
        read_skybox(strip.parent.parent, "aa")
    except InputError as error:
        assert strip.name in str(error)
