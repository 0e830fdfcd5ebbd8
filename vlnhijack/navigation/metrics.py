"""Navigation metrics of a predicted path against a reference path, as HAMT computes them."""

from collections.abc import Sequence
from itertools import pairwise
from math import exp, inf, nan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vlnhijack.errors import InputError
from vlnhijack.navigation.graph import NavigationGraph

SUCCESS_DISTANCE = 3.0


class PathMetrics(NamedTuple):
    """Scores of one path; lengths and errors in metres, rates in [0, 1].

    success is strictly nearer than 3 m. cls is NaN where both paths have zero length.
    """

    success: float
    oracle_success: float
    spl: float
    ndtw: float
    sdtw: float
    cls: float
    dtw: float
    path_length: float
    navigation_error: float
    oracle_error: float


def path_metrics(
    graph: NavigationGraph, prediction: Sequence[str], reference: Sequence[str]
) -> PathMetrics:
    """SR, OSR, SPL (Anderson et al. 2018), nDTW and SDTW (Ilharco et al. 2019), CLS (Jain et al.
    2019).

    Distances are geodesic. Raises InputError for an empty path, an unknown viewpoint, a
    prediction that starts elsewhere than the reference, and viewpoints that are not connected.
    """
    ours = _rows(graph, "prediction", prediction)
    theirs = _rows(graph, "reference", reference)
    if ours[0] != theirs[0]:
        raise InputError(
            file=graph.scan, field="prediction[0]", expected=reference[0], received=prediction[0]
        )
    cost = graph.distances[np.ix_(ours, theirs)]
    if not np.isfinite(cost).all():
        raise InputError(
            file=graph.scan,
            field="prediction",
            expected="viewpoints connected with the reference",
            received=" ".join(prediction),
        )
    return _scores(cost, _length(graph, ours), _length(graph, theirs))


def _scores(cost: NDArray[np.float64], length: float, reference_length: float) -> PathMetrics:
    error, oracle_error = float(cost[-1, -1]), float(cost[:, -1].min())
    success = float(error < SUCCESS_DISTANCE)
    dtw = _dtw(cost.tolist())
    ndtw = exp(-dtw / (SUCCESS_DISTANCE * cost.shape[1]))
    return PathMetrics(
        success=success,
        oracle_success=float(oracle_error < SUCCESS_DISTANCE),
        spl=success * reference_length / max(length, reference_length, 0.01),
        ndtw=ndtw,
        sdtw=success * ndtw,
        cls=_cls(cost, length, reference_length),
        dtw=dtw,
        path_length=length,
        navigation_error=error,
        oracle_error=oracle_error,
    )


def _rows(graph: NavigationGraph, name: str, path: Sequence[str]) -> list[int]:
    if not path:
        raise InputError(file=graph.scan, field=name, expected="≥ 1 viewpoint", received="none")
    return [graph.row(viewpoint) for viewpoint in path]


def _length(graph: NavigationGraph, rows: list[int]) -> float:
    return float(sum(graph.distances[here, there] for here, there in pairwise(rows)))


def _dtw(cost: list[list[float]]) -> float:
    """Dynamic time warping over the cost matrix, prediction by reference."""
    above = [0.0] + [inf] * len(cost[0])
    for row in cost:
        current = [inf]
        for column, value in enumerate(row):
            current.append(value + min(above[column], above[column + 1], current[column]))
        above = current
    return above[-1]


def _cls(cost: NDArray[np.float64], length: float, reference_length: float) -> float:
    """Coverage weighted by length score."""
    coverage = float(np.mean(np.exp(-cost.min(axis=0) / SUCCESS_DISTANCE)))
    expected = coverage * reference_length
    total = expected + abs(expected - length)
    return coverage * expected / total if total else nan
