"""The map of one attack: where the agent goes from v_ATK on, clean and attacked."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Curve
from numpy.typing import NDArray

from vlnhijack.frames import direction, heading_of, wrap
from vlnhijack.navigation.graph import NavigationGraph
from vlnhijack.report.floor_map import HALO, draw_house, extent
from vlnhijack.report.style import (
    ATTACKED,
    CLEAN,
    FAINT,
    HIGHLIGHT,
    INK,
    MUTED,
    RC,
    TARGET,
    save_figure,
)
from vlnhijack.scenes.house import House
from vlnhijack.threat import AttackInstance

LANE = 0.1
TRIM = 0.22
SHIFT = 0.15
DASHES = (0, (3, 1.5))
OCTAGON = (8, 0, 22.5)

Point = NDArray[np.float64]
Walk = Sequence[str]


def trajectory_map(
    path: Path,
    house: House,
    instance: AttackInstance,
    clean: Sequence[Walk],
    attacked: Sequence[Walk],
) -> None:
    """Draw the house from above with the target and the walks of two arms.

    clean, attacked: one walk an episode, viewpoint ids from v_ATK on, v_ATK first. Raises
    InputError for a viewpoint or object that the house does not have.
    """
    x0, y0, x1, y1 = extent(house)
    inches = min(0.75, 9.5 / (x1 - x0), 8.5 / (y1 - y0))
    inches = max(inches, 6.2 / (x1 - x0))
    size = ((x1 - x0 + 0.2) * inches, (y1 - y0 + 0.7) * inches)
    with rc_context(RC):
        figure = Figure(figsize=(size[0] + 0.3, size[1] + 1.2))
        width, height = figure.get_size_inches()
        axes = figure.add_axes((0.15 / width, 0.62 / height, size[0] / width, size[1] / height))
        draw_house(axes, house, instance.object_id)
        left = (0.15 + 0.1 * inches) / width
        figure.text(left, 1 - 0.12 / height, _title(instance), va="top", size=11, weight="bold")
        figure.text(left, 1 - 0.36 / height, _subtitle(clean, attacked), va="top", color=MUTED)
        aside = _free_directions(house, instance, [*clean, *attacked, instance.target_path])
        _draw_target(axes, house.graph, instance, aside)
        for walks, colour, side in ((clean, CLEAN, 1), (attacked, ATTACKED, -1)):
            lanes = Lanes(house.graph, instance.viewpoint, side * LANE)
            _draw_walks(axes, lanes, walks, colour)
        _draw_stops(axes, house.graph, {instance.viewpoint: aside[0]}, clean, attacked)
        figure.legend(
            handles=_legend(instance),
            loc="lower center",
            ncols=4 if width > 8 else 3,
            columnspacing=1.6,
            handlelength=2.2,
            bbox_to_anchor=(0.5, 0.05 / height),
        )
        save_figure(figure, path)


@dataclass(frozen=True)
class Lanes:
    """Edges of a graph shifted sideways, always to the same side seen from an origin.

    shift: metres to the left of an edge that leads away from the origin.
    """

    graph: NavigationGraph
    origin: str
    shift: float

    def point(self, viewpoint: str) -> Point:
        return self.graph.positions[self.graph.row(viewpoint), :2]

    def offset(self, here: str, there: str) -> Point:
        """The sideways shift (2,) of an edge, the same in both directions."""
        near, far = sorted((here, there), key=lambda v: (self.graph.distance(self.origin, v), v))
        along = self.point(far) - self.point(near)
        return self.shift * np.array([-along[1], along[0]]) / np.linalg.norm(along)

    def edge(self, here: str, there: str) -> tuple[Point, Point]:
        """The ends of an edge's lane, cut back from the viewpoints."""
        a, b = self.point(here), self.point(there)
        share = min(TRIM / float(np.linalg.norm(b - a)), 0.3)
        offset = self.offset(here, there)
        return a + share * (b - a) + offset, b + share * (a - b) + offset

    def turn(self, before: str | None, here: str, after: str | None) -> Curve:
        """The curve through a viewpoint; None where the walk begins or ends there."""
        centre = self.point(here)
        start = centre if before is None else self.edge(before, here)[1]
        stop = centre if after is None else self.edge(here, after)[0]
        offsets = [self.offset(here, other) for other in (before, after) if other is not None]
        mean = np.mean(offsets, axis=0)
        mitre = min(self.shift**2 / float(mean @ mean), 2.0) if mean.any() else 1.0
        control = centre + mitre * mean
        return Curve([start, control, stop], [Curve.MOVETO, Curve.CURVE3, Curve.CURVE3])


def _draw_walks(axes: Axes, lanes: Lanes, walks: Sequence[Walk], colour: str) -> None:
    """Lanes as wide as the share of the walks that use them, with arrows."""
    pieces = list(_pieces(lanes, walks))
    for curve, share in pieces:
        _stroke(axes, curve, 3.0 + 3.5 * share, "white", 5)
    for curve, share in pieces:
        _stroke(axes, curve, 1.0 + 3.5 * share, colour, 6)
    steps = Counter(step for walk in walks for step in set(pairwise(walk)))
    for (here, there), count in steps.items():
        start, stop = lanes.edge(here, there)
        _arrow(axes, start, stop, colour, 5.5 + 3.5 * count / len(walks))


def _pieces(lanes: Lanes, walks: Sequence[Walk]) -> Iterator[tuple[Curve, float]]:
    """Every straight and every turn with the share of the walks that use it."""
    edges: Counter[tuple[str, ...]] = Counter()
    turns: Counter[tuple[str | None, str, str | None]] = Counter()
    for walk in walks:
        if len(walk) > 1:
            edges.update({tuple(sorted(step)) for step in pairwise(walk)})
            padded = [None, *walk, None]
            turns.update(set(zip(padded, walk, padded[2:], strict=False)))
    for (here, there), count in edges.items():
        yield Curve(np.array(lanes.edge(here, there))), count / len(walks)
    for turn, count in turns.items():
        yield lanes.turn(*turn), count / len(walks)


def _draw_target(
    axes: Axes, graph: NavigationGraph, instance: AttackInstance, aside: list[Point]
) -> None:
    """v_ATK and the attack trajectory, or a STOP sign where it is empty."""
    points = np.array([graph.positions[graph.row(v), :2] for v in instance.target_path])
    axes.plot(*points[0], "*", ms=17, color=INK, mec="white", mew=1, zorder=9)
    name = points[0] + 0.36 * aside[1]
    _centred(axes, name, "$v_{ATK}$", size=10, path_effects=HALO, zorder=9)
    if not instance.trajectory:
        sign = points[0] + 0.5 * aside[2]
        axes.plot(*sign, marker=OCTAGON, ms=23, color=TARGET, mec="white", mew=1, zorder=9)
        _centred(axes, sign, "STOP", size=6, color="white", weight="bold", zorder=10)
        return
    axes.plot(*points.T, color=TARGET, lw=1.6, ls=DASHES, zorder=7)
    for start, stop in pairwise(points):
        _arrow(axes, start, stop, TARGET, 5, at=0.5)
    axes.plot(*points[-1], "o", ms=20, mfc="none", mec=TARGET, mew=1.8, zorder=8)


def _draw_stops(
    axes: Axes,
    graph: NavigationGraph,
    aside: dict[str, Point],
    clean: Sequence[Walk],
    attacked: Sequence[Walk],
) -> None:
    """Discs with the number of walks that end at a viewpoint, beside those named in `aside`."""
    ends = [Counter(walk[-1] for walk in walks) for walks in (clean, attacked)]
    for viewpoint in sorted(ends[0] | ends[1]):
        middle = graph.positions[graph.row(viewpoint), :2] + 0.38 * aside.get(
            viewpoint, np.zeros(2)
        )
        both = ends[0][viewpoint] and ends[1][viewpoint]
        for counts, colour, side in zip(ends, (CLEAN, ATTACKED), (-1, 1), strict=True):
            if counts[viewpoint]:
                at = middle + (side * SHIFT if both else 0, 0)
                axes.plot(*at, "o", ms=13, color=colour, mec="white", mew=1, zorder=10)
                count = str(counts[viewpoint])
                _centred(axes, at, count, size=7, color="white", weight="bold", zorder=11)


def _free_directions(house: House, instance: AttackInstance, walks: Sequence[Walk]) -> list[Point]:
    """Three unit vectors from v_ATK, away from all first steps, the object and each other."""
    graph = house.graph
    busy = [graph.positions[graph.row(v)] for v in sorted({v for walk in walks for v in walk[1:2]})]
    busy.append(np.array(house.object(instance.object_id).centre))
    taken = [float(heading_of(p - graph.positions[graph.row(instance.viewpoint)])) for p in busy]
    compass = np.arange(8) * np.pi / 4
    found = []
    for _ in range(3):
        room = np.abs(wrap(compass[:, None] - np.array(taken))).min(axis=1)
        found.append(float(compass[room.argmax()]))
        taken.append(found[-1])
    return [direction(heading)[:2] for heading in found]


def _centred(axes: Axes, at: Point, text: str, **style: Any) -> None:
    axes.text(at[0], at[1], text, ha="center", va="center_baseline", **style)


def _stroke(axes: Axes, curve: Curve, width: float, colour: str, order: float) -> None:
    axes.add_patch(PathPatch(curve, fc="none", ec=colour, lw=width, capstyle="round", zorder=order))


def _arrow(
    axes: Axes, start: Point, stop: Point, colour: str, size: float, at: float = 0.62
) -> None:
    x, y = start + at * (stop - start)
    angle = np.degrees(np.arctan2(*(stop - start)[::-1])) - 90
    axes.plot(x, y, marker=(3, 0, angle), ms=size, color=colour, mec="white", mew=0.4, zorder=8)


def _title(instance: AttackInstance) -> str:
    kind = "Trajectory" if instance.trajectory else "Single-step"
    return f"{kind} attack through {instance.object_id} in {instance.scan}"


def _subtitle(clean: Sequence[Walk], attacked: Sequence[Walk]) -> str:
    return (
        f"walks from $v_{{ATK}}$ on, {len(clean)} clean and {len(attacked)} attacked episodes; "
        "wider: walked more often"
    )


def _legend(instance: AttackInstance) -> list[Line2D]:
    def line(label: str, **style: Any) -> Line2D:
        return Line2D([], [], label=label, **style)

    if instance.trajectory:
        target = line("attack trajectory (target)", color=TARGET, ls=DASHES, lw=1.6)
    else:
        target = line("target: STOP", color=TARGET, marker=OCTAGON, ms=11, ls="")
    return [
        line("clean agent", color=CLEAN, lw=3.5),
        line("attacked agent", color=ATTACKED, lw=3.5),
        target,
        line("where the attack strikes, $v_{ATK}$", color=INK, marker="*", ms=11, ls=""),
        line("attacked object", color=HIGHLIGHT, marker="s", mec=INK, ms=9, ls=""),
        line("number of episodes that stop here", color=MUTED, marker="o", ms=11, ls=""),
        line("navigation graph", color=FAINT, marker="o", ms=4, lw=0.8),
    ]
