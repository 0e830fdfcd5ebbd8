"""Images, before/after comparisons, contact sheets and curves as PNG files."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont
from numpy.typing import ArrayLike, NDArray
from PIL import Image, ImageDraw, ImageFont
from scipy.ndimage import binary_dilation, uniform_filter1d

from vlnhijack.artifacts import atomic_path
from vlnhijack.attack.optimise import Validation, best
from vlnhijack.display import to_8bit
from vlnhijack.errors import InputError
from vlnhijack.report.style import (
    ATTACKED,
    CLEAN,
    FAINT,
    HIGHLIGHT,
    INK,
    MUTED,
    RC,
    save_figure,
    save_overview,
)

Pixels = NDArray[np.float32]
Rows = Sequence[Mapping[str, float]]
GUTTER = 6
CAPTION = 18
HEADER = 26
SHEET_TILE = 160
OUTLINE = 2
SMOOTHING = 15


def save_image(path: Path, image: ArrayLike) -> None:
    """Write display values (3,h,w) or (h,w,3) as an 8-bit PNG, whole or not at all.

    Raises InputError for any other shape.
    """
    _save(Image.fromarray(to_8bit(_pixels(image))), path)


def save_mask(path: Path, mask: NDArray[np.bool_]) -> None:
    """Write a mask (h,w) as an 8-bit grey PNG, 255 where it is true, whole or not at all."""
    _save(Image.fromarray(np.where(mask, 255, 0).astype(np.uint8)), path)


def outlined(image: ArrayLike, mask: NDArray[np.bool_]) -> Pixels:
    """The image (h,w,3) with a yellow line around a mask (h,w), 2 pixels wide in a contact sheet.

    The masked pixels themselves stay as they are.
    """
    pixels = _pixels(image)
    wide = OUTLINE * max(1, round(pixels.shape[1] / SHEET_TILE))
    line = binary_dilation(mask, np.ones((3, 3)), iterations=wide) & ~mask
    return np.where(line[..., None], np.asarray(to_rgb(HIGHLIGHT), np.float32), pixels)


def before_after(
    path: Path, before: Sequence[ArrayLike], after: Sequence[ArrayLike], titles: Sequence[str]
) -> None:
    """Rows of views (3,h,w), one title each: before, after, amplified difference around grey.

    One gain, printed above its column, serves all rows. The picture has 256 colours; `save_image`
    keeps the exact pixels. Raises InputError where the lists differ in length or the views in
    shape.
    """
    if not len(before) == len(after) == len(titles) > 0:
        raise InputError(
            field="before_after",
            expected="as many images before as after and titles, at least one",
            received=(len(before), len(after), len(titles)),
        )
    pairs = [(_pixels(a), _pixels(b)) for a, b in zip(before, after, strict=True)]
    if len({image.shape for pair in pairs for image in pair}) > 1:
        shapes = [(a.shape, b.shape) for a, b in pairs]
        raise InputError(field="before_after", expected="views of one size", received=shapes)
    gain = _gain([b - a for a, b in pairs])
    images = [image for a, b in pairs for image in (a, b, 0.5 + gain * (b - a))]
    captions = [text for title in titles for text in (title, "", "")]
    sheet = _grid([_tile(image, 240, 320) for image in images], 3, captions, HEADER)
    heads = ("before", "after", f"difference × {gain} (grey: none)")
    step = (sheet.width - GUTTER) / 3
    draw, bold = ImageDraw.Draw(sheet), _font(13, "bold")
    for column, head in enumerate(heads):
        draw.text((GUTTER + column * step, GUTTER), head, INK, bold)
    save_overview(sheet, path)


def contact_sheet(
    path: Path, images: ArrayLike, columns: int = 12, labels: Sequence[str] | None = None
) -> None:
    """All views (V,3,h,w) as tiles of at most 160 pixels in 256 colours, with labels above.

    Raises InputError for another shape or another number of labels than images.
    """
    views = np.asarray(images, np.float32)
    if views.ndim != 4 or views.shape[1] != 3 or len(views) == 0:
        raise InputError(field="images", expected="(V,3,h,w), V ≥ 1", received=views.shape)
    if labels is not None and len(labels) != len(views):
        raise InputError(field="labels", expected=len(views), received=len(labels))
    tiles = [_tile(_pixels(view), 1, SHEET_TILE) for view in views]
    save_overview(_grid(tiles, min(columns, len(views)), labels), path)


def curve(path: Path, log: Rows, validations: Rows) -> None:
    """Training loss, validation loss and validation nDTW against the iteration.

    log: rows with iteration and loss; validations: rows with iteration, loss and ndtw (0–1), the
    kept one of which is marked. Raises InputError where either is empty.
    """
    if not log or not validations:
        raise InputError(field="curve", expected="rows", received=(len(log), len(validations)))
    with rc_context(RC):
        figure = Figure(figsize=(6.4, 4.4), layout="constrained")
        top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
        _draw_losses(top, log, validations)
        _draw_ndtw(bottom, validations)
        figure.align_ylabels()
        save_figure(figure, path)


def _save(picture: Image.Image, path: Path) -> None:
    with atomic_path(path) as temporary:
        picture.save(temporary, optimize=True)


def _draw_losses(axes: Axes, log: Rows, validations: Rows) -> None:
    iterations, losses = _column(log, "iteration"), _column(log, "loss")
    smooth = uniform_filter1d(losses, SMOOTHING, mode="nearest")
    axes.plot(iterations, losses, color=FAINT, lw=0.8, label="training, each batch")
    axes.plot(iterations, smooth, color=ATTACKED, lw=1.8, label=f"training, mean of {SMOOTHING}")
    iterations, losses = _column(validations, "iteration"), _column(validations, "loss")
    axes.plot(iterations, losses, "o-", color=CLEAN, lw=1.4, ms=4, label="validation")
    axes.set_ylabel("loss, −log π(attack trajectory)")
    axes.set_ylim(bottom=min(0, axes.get_ylim()[0]))
    axes.legend(loc="upper right")


def _draw_ndtw(axes: Axes, validations: Rows) -> None:
    iterations, ndtw = _column(validations, "iteration"), 100 * _column(validations, "ndtw")
    axes.plot(iterations, ndtw, "o-", color=CLEAN, lw=1.4, ms=4)
    kept = best([Validation(int(v["iteration"]), v["ndtw"], v["loss"]) for v in validations])
    axes.plot(
        kept.iteration,
        100 * kept.ndtw,
        "o",
        ms=10,
        mfc="none",
        mec=INK,
        mew=1.4,
        label=f"kept: iteration {kept.iteration}, nDTW {100 * kept.ndtw:.0f} %",
    )
    axes.legend(loc="lower right")
    axes.set(xlabel="iteration", ylabel="validation nDTW, %", ylim=(-4, 106))


def _grid(
    tiles: Sequence[Image.Image], columns: int, captions: Sequence[str] | None, top: int = 0
) -> Image.Image:
    """Tiles of one size, row by row on white, below a margin, with captions above them."""
    extra = CAPTION if captions else 0
    step = (tiles[0].width + GUTTER, tiles[0].height + GUTTER + extra)
    rows = -(-len(tiles) // columns)
    sheet = Image.new("RGB", (columns * step[0] + GUTTER, top + rows * step[1] + GUTTER), "white")
    draw, font = ImageDraw.Draw(sheet), _font(11, "normal")
    for number, tile in enumerate(tiles):
        row, column = divmod(number, columns)
        x, y = GUTTER + column * step[0], top + GUTTER + row * step[1]
        if captions:
            draw.text((x, y), captions[number], MUTED, font)
        sheet.paste(tile, (x, y + extra))
    return sheet


def _tile(image: Pixels, least: int, most: int) -> Image.Image:
    """An image (h,w,3) enlarged by a whole factor to a width of at least `least` pixels, or
    reduced to `most`."""
    height, width = image.shape[:2]
    picture = Image.fromarray(to_8bit(image))
    factor = -(-least // width)
    if factor > 1:
        return picture.resize((factor * width, factor * height), Image.Resampling.NEAREST)
    if width > most:
        return picture.resize((most, round(most * height / width)), Image.Resampling.LANCZOS)
    return picture


def _pixels(image: ArrayLike) -> Pixels:
    """Rows × columns × RGB of an image in either order of axes."""
    array = np.asarray(image, np.float32)
    if array.ndim == 3 and array.shape[0] == 3:
        return array.transpose(1, 2, 0)
    if array.ndim == 3 and array.shape[2] == 3:
        return array
    raise InputError(field="image", expected="(3,h,w) or (h,w,3)", received=array.shape)


def _gain(differences: Sequence[Pixels]) -> int:
    """The power of two, 1 to 32, that spreads the changes over the range; the top 1 % may clip."""
    changes = np.abs(np.concatenate([difference.ravel() for difference in differences]))
    changed = changes[changes > 1 / 255]
    large = float(np.percentile(changed, 99)) if len(changed) else 0.5
    return int(2 ** np.clip(np.round(np.log2(0.5 / large)), 0, 5))


def _column(rows: Rows, key: str) -> NDArray[np.float64]:
    return np.array([row[key] for row in rows], float)


def _font(size: int, weight: str) -> ImageFont.FreeTypeFont:
    return ImageFont.truetype(findfont(FontProperties(family="DejaVu Sans", weight=weight)), size)
