"""A house from above: walls, floors, furniture, rooms and the navigation graph."""

from collections.abc import Iterator

import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from vlnhijack.report.style import FAINT, HIGHLIGHT, INK, MUTED
from vlnhijack.scenes.house import House

WALL = 0.12
WALL_COLOUR = "#5A5A5A"
FURNITURE = "#EFEAE1"
FURNITURE_EDGE = "#D5CCBC"
FLAT = "#F8F5EF"
HALO = [patheffects.withStroke(linewidth=2.5, foreground="white")]

Extent = tuple[float, float, float, float]


def extent(house: House) -> Extent:
    """(x0, y0, x1, y1) of all rooms with their outer walls, metres."""
    bounds = np.array([room.bounds for room in house.rooms])
    x0, y0 = bounds[:, :2].min(axis=0) - WALL
    x1, y1 = bounds[:, 2:].max(axis=0) + WALL
    return float(x0), float(y0), float(x1), float(y1)


def draw_house(axes: Axes, house: House, highlighted: str) -> None:
    """Draw the house with one object highlighted and named, and a scale bar below it."""
    for room in house.rooms:
        x0, y0, x1, y1 = room.bounds
        size = (x1 - x0 + 2 * WALL, y1 - y0 + 2 * WALL)
        axes.add_patch(Rectangle((x0 - WALL, y0 - WALL), *size, color=WALL_COLOUR, lw=0, zorder=0))
        axes.text(
            x0 + 0.15,
            y1 - 0.15,
            room.label,
            ha="left",
            va="top",
            size=8,
            style="italic",
            color=MUTED,
            path_effects=HALO,
            zorder=8.5,
        )
    floors = list(_floor_triangles(house))
    axes.add_collection(PolyCollection(floors, fc="white", ec="white", lw=1.0, zorder=1))
    _draw_furniture(axes, house, highlighted)
    _draw_graph(axes, house)
    _draw_scale(axes, house)
    x0, y0, x1, y1 = extent(house)
    axes.set(xlim=(x0 - 0.1, x1 + 0.1), ylim=(y0 - 0.6, y1 + 0.1), aspect="equal")
    axes.set_axis_off()


def _floor_triangles(house: House) -> Iterator[NDArray[np.float64]]:
    """Upward faces (3,2) of the background at floor height; doorways count, so walls open there."""
    floor = float(np.median(house.graph.positions[:, 2] - house.graph.heights))
    for surface in house.surfaces:
        if surface.object_id is None:
            corners = surface.vertices[surface.faces].astype(np.float64)
            normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            up = normals[:, 2] > 0.99 * np.linalg.norm(normals, axis=1)
            low = np.abs(corners[:, :, 2] - floor).max(axis=1) < 0.05
            yield from corners[up & low][:, :, :2]


def _draw_furniture(axes: Axes, house: House, highlighted: str) -> None:
    """Silhouettes, the low ones first, so that a table covers its rug."""
    by_height = sorted(house.objects, key=lambda item: item.centre[2] + item.size[2] / 2)
    for rank, item in enumerate(by_height):
        parts = house.parts(item.id)
        faces = np.concatenate([part.vertices[part.faces][:, :, :2] for part in parts])
        order = 2 + rank / len(by_height)
        if item.id == highlighted:
            fill, line, width, order = HIGHLIGHT, INK, 2.6, 3.2
        else:
            fill, line, width = FLAT if item.size[2] < 0.06 else FURNITURE, FURNITURE_EDGE, 1.3
        for colour, stroke in ((line, width), (fill, 0.3)):
            triangles = PolyCollection(list(faces), fc=colour, ec=colour, lw=stroke, zorder=order)
            axes.add_collection(triangles)
    item = house.object(highlighted)
    axes.text(
        *item.centre[:2], item.id, size=8, ha="center", va="center", path_effects=HALO, zorder=9
    )


def _draw_graph(axes: Axes, house: House) -> None:
    positions = house.graph.positions[:, :2]
    edges = np.argwhere(np.triu(house.graph.adjacency, 1))
    axes.add_collection(LineCollection(list(positions[edges]), colors=FAINT, lw=0.8, zorder=3.5))
    axes.plot(*positions.T, "o", ms=3.2, color=FAINT, mec="white", mew=0.5, zorder=3.6)


def _draw_scale(axes: Axes, house: House) -> None:
    """A bar of two metres below the lower left corner."""
    x0, y0, _, _ = extent(house)
    y = y0 - 0.3
    axes.plot([x0, x0 + 2], [y, y], color=INK, lw=2, solid_capstyle="butt")
    axes.text(x0 + 2.12, y, "2 m", va="center", size=8.5)
