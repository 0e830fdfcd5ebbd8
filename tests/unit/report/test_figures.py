"""Pictures hold the pixels they are given, and are refused where the input does not fit."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from vlnhijack import seeds
from vlnhijack.errors import InputError
from vlnhijack.report.figures import (
    before_after,
    contact_sheet,
    curve,
    outlined,
    save_image,
    save_mask,
)
from vlnhijack.report.style import ATTACKED, CLEAN, HIGHLIGHT, INK

VIEWS = seeds.stream(0, "report views").random((5, 3, 72, 96)).astype(np.float32)


def read(path: Path) -> np.ndarray:
    return np.asarray(Image.open(path).convert("RGB"))


def levels(view: np.ndarray) -> np.ndarray:
    return np.round(view.transpose(1, 2, 0) * 255).astype(np.uint8)


def close_to(pixels: np.ndarray, colour: str) -> int:
    """How many pixels are within a few levels of a colour."""
    wanted = [int(colour[at : at + 2], 16) for at in (1, 3, 5)]
    return int((np.abs(pixels.astype(int) - wanted).max(axis=2) <= 6).sum())


def test_image_in_either_order_of_axes(tmp_path: Path) -> None:
    save_image(tmp_path / "a.png", VIEWS[0])
    save_image(tmp_path / "b.png", VIEWS[0].transpose(1, 2, 0))
    assert np.array_equal(read(tmp_path / "a.png"), levels(VIEWS[0]))
    assert np.array_equal(read(tmp_path / "b.png"), levels(VIEWS[0]))


def test_refused_image_leaves_no_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\(3,h,w\)"):
        save_image(tmp_path / "a.png", VIEWS)
    assert not list(tmp_path.iterdir())


def test_a_mask_is_saved_as_it_is_and_outlined_outside(tmp_path: Path) -> None:
    mask = np.zeros((72, 96), bool)
    mask[20:40, 30:50] = True
    save_mask(tmp_path / "a.png", mask)
    saved = np.asarray(Image.open(tmp_path / "a.png"))
    assert saved.dtype == np.uint8 and np.array_equal(saved, 255 * mask)
    drawn, pixels = outlined(VIEWS[0], mask), VIEWS[0].transpose(1, 2, 0)
    changed = (drawn != pixels).any(2)
    ring = np.zeros_like(mask)
    ring[18:42, 28:52] = True
    assert np.array_equal(changed, ring & ~mask)
    assert close_to(255 * drawn, HIGHLIGHT) >= changed.sum()
    assert np.array_equal(outlined(VIEWS[0], np.zeros_like(mask)), pixels)


def test_before_after_shows_both_and_the_doubled_difference(tmp_path: Path) -> None:
    before = np.full((3, 72, 96), 0.4, np.float32)
    after = before.copy()
    after[0, 20:60, 30:70] += 0.24
    before_after(tmp_path / "a.png", [before] * 2, [after] * 2, ["first", "second"])
    pixels = read(tmp_path / "a.png")
    height, width = 3 * 72, 3 * 96  # enlarged by a whole factor to at least 240 pixels
    assert pixels.shape[1] == 3 * width + 4 * 6 and pixels.shape[0] > 2 * height
    first = np.argwhere((pixels == 102).all(axis=2))[0]
    changed = np.argwhere((pixels == (163, 102, 102)).all(axis=2))[0]
    assert tuple(changed - first) == (3 * 20, width + 6 + 3 * 30)
    third = tuple(first + (3 * 40, 2 * (width + 6) + 3 * 50))
    assert tuple(pixels[third]) == (250, 128, 128)  # 0.5 + 2 · 0.24


def test_before_after_refuses_unlike_lists(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="as many images"):
        before_after(tmp_path / "a.png", VIEWS[:2], VIEWS[:1], ["a", "b"])
    with pytest.raises(InputError, match="one size"):
        before_after(tmp_path / "a.png", VIEWS[:1], VIEWS[:1, :, :9], ["a"])
    assert not list(tmp_path.iterdir())


def test_equal_images_have_a_grey_difference(tmp_path: Path) -> None:
    before_after(tmp_path / "a.png", VIEWS[:1], VIEWS[:1], ["view"])
    assert np.all(read(tmp_path / "a.png")[-100:-10, -200:-10] == 128)


def test_contact_sheet_is_row_by_row(tmp_path: Path) -> None:
    contact_sheet(tmp_path / "a.png", VIEWS, columns=3)
    pixels = read(tmp_path / "a.png")
    assert pixels.shape == (2 * 78 + 6, 3 * 102 + 6, 3)
    for number, view in enumerate(VIEWS):
        y, x = 6 + 78 * (number // 3), 6 + 102 * (number % 3)
        error = np.abs(pixels[y : y + 72, x : x + 96].astype(int) - levels(view))
        assert error.mean() < 15  # 256 colours for white noise; another view differs by 85
    with pytest.raises(InputError, match="labels"):
        contact_sheet(tmp_path / "a.png", VIEWS, labels=["one"])


def test_curve_marks_the_kept_checkpoint(tmp_path: Path) -> None:
    log = [{"iteration": i, "loss": 3.0 / i} for i in range(1, 41)]
    found = [
        {"iteration": i, "loss": 3.0 / i, "ndtw": n} for i, n in ((10, 0.4), (20, 0.9), (40, 0.7))
    ]
    curve(tmp_path / "a.png", log, found)
    pixels = read(tmp_path / "a.png")
    assert close_to(pixels, CLEAN) > 500 and close_to(pixels, ATTACKED) > 500
    ring = pixels[pixels.shape[0] // 2 :, pixels.shape[1] // 4 : pixels.shape[1] * 3 // 4]
    assert close_to(ring, INK) > 50
    with pytest.raises(InputError, match="rows"):
        curve(tmp_path / "b.png", log, [])
