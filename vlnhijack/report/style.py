"""Palette (colour-blind safe, after Okabe & Ito) and type of every figure."""

from io import BytesIO
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from PIL import Image

from vlnhijack.artifacts import atomic_path

CLEAN = "#0072B2"
ATTACKED = "#E08A00"
TARGET = "#C8102E"
HIGHLIGHT = "#F0E442"
INK = "#222222"
MUTED = "#7A7A7A"
FAINT = "#C9C9C9"

DPI = 150
RC: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.titlesize": 10,
    "axes.labelsize": 9,
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "text.color": INK,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
}


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure as PNG at 150 dpi, whole or not at all."""
    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=DPI)
    save_overview(Image.open(buffer).convert("RGB"), path)


def save_overview(picture: Image.Image, path: Path) -> None:
    """Write an RGB picture as a PNG of 256 colours, a third of the size, whole or not at all."""
    with atomic_path(path) as temporary:
        picture.quantize(256).save(temporary, optimize=True, dpi=(DPI, DPI))
