from itertools import pairwise
from math import exp, isnan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vlnhijack.errors import InputError
from vlnhijack.navigation.graph import NavigationGraph
from vlnhijack.navigation.metrics import path_metrics


def chain(length: int = 8, gap: float = 1.5) -> NavigationGraph:
    """Viewpoints "0", "1", … on a line, `gap` metres apart, and one that nothing reaches."""
    positions = np.zeros((length + 1, 3))
    positions[:, 0] = gap * np.arange(length + 1)
    adjacency = np.zeros((length + 1,) * 2, bool)
    for here, there in pairwise(range(length)):
        adjacency[here, there] = adjacency[there, here] = True
    names = (*map(str, range(length)), "island")
    return NavigationGraph("chain", names, positions, adjacency, np.ones(length + 1))


CHAIN = chain()


def test_the_reference_itself_is_perfect() -> None:
    scores = path_metrics(CHAIN, list("0123"), list("0123"))
    assert (scores.success, scores.spl, scores.ndtw, scores.sdtw, scores.cls) == (1, 1, 1, 1, 1)
    assert scores.path_length == pytest.approx(4.5)
    assert scores.navigation_error == 0


def test_three_metres_away_is_no_success() -> None:
    scores = path_metrics(CHAIN, list("01"), list("0123"))
    assert (scores.navigation_error, scores.success) == (3.0, 0.0)
    assert path_metrics(chain(gap=1.4999), list("01"), list("0123")).success == 1.0


def test_a_path_that_walks_through_the_goal_is_an_oracle_success_only() -> None:
    scores = path_metrics(CHAIN, list("01234567"), list("0123"))
    assert (scores.success, scores.oracle_success, scores.sdtw, scores.spl) == (0, 1, 0, 0)


def test_spl_weighs_the_detour() -> None:
    scores = path_metrics(CHAIN, list("01212343"), list("0123"))
    assert scores.spl == pytest.approx(4.5 / 10.5)


def test_ndtw_of_a_path_that_stays() -> None:
    assert path_metrics(CHAIN, ["0"], list("012")).ndtw == pytest.approx(exp(-4.5 / 9))


def test_references_of_zero_length() -> None:
    scores = path_metrics(CHAIN, ["0"], ["0"])
    assert (scores.success, scores.spl) == (1, 0) and isnan(scores.cls)


@pytest.mark.parametrize(
    ("prediction", "reference", "message"),
    [
        ([], ["0"], "prediction: expected ≥ 1 viewpoint"),
        (["0"], [], "reference"),
        (["1"], ["0", "1"], r"prediction\[0\]: expected 0, received '1'"),
        (["0", "x"], ["0", "1"], "viewpoint.*received 'x'"),
        (["0", "island"], ["0", "1"], "connected"),
    ],
)
def test_bad_paths_are_explained(prediction: list[str], reference: list[str], message: str) -> None:
    with pytest.raises(InputError, match=message):
        path_metrics(CHAIN, prediction, reference)


steps = st.lists(st.integers(0, 7).map(str), max_size=9)


@given(steps, steps)
def test_scores_keep_their_bounds(walk: list[str], way: list[str]) -> None:
    scores = path_metrics(CHAIN, ["3", *walk], ["3", *way])
    assert 0 <= scores.sdtw <= scores.ndtw <= 1
    assert 0 <= scores.spl <= scores.success <= scores.oracle_success <= 1
    assert scores.oracle_error <= scores.navigation_error
    assert isnan(scores.cls) or 0 <= scores.cls <= 1
