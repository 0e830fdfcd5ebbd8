from math import comb

import pytest

from vlnhijack.errors import CheckError
from vlnhijack.evaluation.gate import check_baseline


def at_most(successes: int, n: int, rate: float) -> float:
    return sum(comb(n, k) * rate**k * (1 - rate) ** (n - k) for k in range(successes + 1))


@pytest.mark.parametrize(("n", "recorded"), [(60, 0.8), (200, 0.75)])
def test_the_gate_closes_below_one_percent(n: int, recorded: float) -> None:
    allowed = min(k for k in range(n) if at_most(k, n, recorded) >= 0.01)
    assert allowed < recorded * n
    check_baseline("alder", allowed, n, recorded)
    check_baseline("alder", n, n, recorded)
    with pytest.raises(CheckError, match=f"alder .* {allowed - 1} of {n} .* record {recorded:.3f}"):
        check_baseline("alder", allowed - 1, n, recorded)
