"""Plots of benchmarks: time against error, and growth."""

from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from vlnhijack.report.style import ATTACKED, CLEAN, MUTED, RC, save_figure

Rows = Sequence[Mapping[str, Any]]
_COLOURS = (CLEAN, ATTACKED)
_MARKERS = ("o", "s")
_SMALLEST = 1e-7


def pareto(path: Path, rows: Rows, title: str) -> None:
    """Seconds of an image with its gradient against RMSE and against 1 − gradient cosine, log-log.

    rows: those of render.json, one line of the plot per rung, its samples per pixel written beside.
    """
    with rc_context(RC):
        figure = Figure(figsize=(8.4, 3.8), layout="constrained")
        left, right = figure.subplots(1, 2)
        _curves(left, rows, lambda row: row["rmse"], "image RMSE, display values")
        _curves(right, rows, lambda row: 1 - row["grad_cosine"], "1 − cosine of the gradient")
        left.legend(loc="center")
        figure.suptitle(f"{title}; numbers: samples per pixel", fontsize=10)
        save_figure(figure, path)


def _curves(axes: Axes, rows: Rows, error: Any, label: str) -> None:
    for (rung, group), colour, marker in zip(_by(rows, "rung"), _COLOURS, _MARKERS, strict=False):
        times = [1000 * row["forward_backward_s"] for row in group]
        errors = [max(error(row), _SMALLEST) for row in group]
        axes.plot(times, errors, color=colour, marker=marker, ms=5, lw=1.4, label=rung)
        for row, x, y in zip(group, times, errors, strict=True):
            axes.annotate(
                str(row["spp"]), (x, y), (5, 5), textcoords="offset points", color=MUTED, fontsize=8
            )
    axes.set(xscale="log", yscale="log", ylabel=label)
    axes.set_xlabel("image with gradient, ms")
    low, high = axes.get_ylim()
    if high < 10 * low:
        axes.set_ylim(low / 3, 3 * high)
    axes.grid(color="#EEEEEE")


def growth(path: Path, points: Rows) -> None:
    """Seconds and megabytes against faces, texels, views and samples, log-log.

    points: those of scaling.json.
    """
    measures = {
        "forward_backward_s": "image with\ngradient, s",
        "build_s": "build, s",
        "memory_mb": "memory, MB",
    }
    axes_names = list(dict.fromkeys(point["axis"] for point in points))
    with rc_context(RC):
        figure = Figure(figsize=(2.4 * len(axes_names), 5.6), layout="constrained")
        grid = figure.subplots(3, len(axes_names), sharex="col", sharey="row", squeeze=False)
        for column, name in enumerate(axes_names):
            chosen = [point for point in points if point["axis"] == name]
            for axes, (measure, label) in zip(grid[:, column], measures.items(), strict=True):
                for (rung, group), colour in zip(_by(chosen, "rung"), _COLOURS, strict=False):
                    values = [max(point[measure], 1e-4) for point in group]
                    axes.plot(
                        [point["value"] for point in group], values, "o-", color=colour, label=rung
                    )
                axes.set(xscale="log", yscale="log")
                axes.grid(color="#EEEEEE")
                axes.xaxis.set_minor_formatter(NullFormatter())
                if column == 0:
                    axes.set_ylabel(label)
            grid[2, column].set_xlabel(name)
        grid[0, 0].legend(loc="upper left")
        save_figure(figure, path)


def _by(rows: Rows, key: str) -> list[tuple[str, list[Mapping[str, Any]]]]:
    ordered = sorted(rows, key=lambda row: str(row[key]))
    return [(name, list(group)) for name, group in groupby(ordered, lambda row: str(row[key]))]
