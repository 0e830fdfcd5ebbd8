"""Rates with n and intervals, from records."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import pandas as pd

from vlnhijack import seeds

CONTROLS = ("clean", "noise")
ATTACKED = "attacked"
NOISE_ARMS = ("noise_texel", "noise_block")
CONDITIONS = ("Train", "Validation", "Test")
_MEASURES = {
    "single_step": ("stop_rate",),
    "trajectory": ("sr", "osr", "ndtw"),
    "original": ("sr", "ndtw"),
}
_DRAWS = 2000

Summary = dict[str, Any]


def summarise(records: pd.DataFrame) -> Summary:
    """The tables of the paper: condition Test at the top level, all of them under "conditions".

    "single_step": {arm: {n, stop_rate}}; "trajectory": {arm: {n, sr, osr, ndtw}} against the
    attack trajectory; "original": {arm: {n, sr, ndtw}} of the same episodes against their own
    path. Where attacks were made with several rungs, each rung is an arm instead of "attacked".
    Every rate has a `<rate>_ci`, a 95 % bootstrap interval whose clusters are objects, or paths
    where there is a single object. Of the two noise textures the stronger one counts.
    """
    chosen = stronger_noise(name_rungs(records))
    by_condition = {
        condition: _tables(chosen[chosen["condition"] == condition]) for condition in CONDITIONS
    }
    return {**by_condition["Test"], "conditions": by_condition}


def name_rungs(records: pd.DataFrame) -> pd.DataFrame:
    """Where attacks of several rungs are there, each is an arm of its rung's name."""
    attacked = records["arm"] == ATTACKED
    if records.loc[attacked, "rung"].nunique() < 2:
        return records
    return records.assign(arm=records["arm"].where(~attacked, records["rung"]))


def stronger_noise(records: pd.DataFrame) -> pd.DataFrame:
    """Keep, per kind of attack, the noise arm with the higher Test rate, renamed "noise"."""
    kept = [records[~records["arm"].isin(NOISE_ARMS)]]
    for kind, rate in (("single_step", "stopped"), ("trajectory", "attack_ndtw")):
        of_kind = records[(records["kind"] == kind) & records["arm"].isin(NOISE_ARMS)]
        if of_kind.empty:
            continue
        rates = of_kind[of_kind["condition"] == "Test"].groupby("arm")[rate].mean()
        kept.append(of_kind[of_kind["arm"] == rates.idxmax()].assign(arm="noise"))
    return pd.concat(kept, ignore_index=True)


def _tables(records: pd.DataFrame) -> Summary:
    single = records[records["kind"] == "single_step"]
    trajectory = records[records["kind"] == "trajectory"]
    return {
        "single_step": _by_arm(single, {"stop_rate": "stopped"}),
        "trajectory": _by_arm(
            trajectory,
            {"sr": "attack_success", "osr": "attack_oracle_success", "ndtw": "attack_ndtw"},
        ),
        "original": _by_arm(trajectory, {"sr": "original_success", "ndtw": "original_ndtw"}),
    }


def _by_arm(records: pd.DataFrame, rates: dict[str, str]) -> Summary:
    table: Summary = {}
    arms = records["arm"].unique()
    for arm in sorted(arms, key=[*CONTROLS, *arms].index):
        rows = records[records["arm"] == arm]
        table[arm] = {"n": len(rows)}
        for name, column in rates.items():
            table[arm][name] = float(rows[column].mean())
            table[arm][f"{name}_ci"] = interval(rows, column)
    return table


def interval(records: pd.DataFrame, column: str) -> tuple[float, float]:
    """95 % percentile bootstrap of the mean over clusters: objects, or paths of a single object."""
    cluster = "object" if records.groupby(["scan", "object"]).ngroups > 1 else "path_id"
    groups = records.groupby(["scan", cluster])[column].agg(["sum", "count"]).to_numpy(float)
    rng = seeds.stream(0, "bootstrap", column)
    drawn = groups[rng.integers(len(groups), size=(_DRAWS, len(groups)))].sum(1)
    low, high = np.percentile(drawn[:, 0] / drawn[:, 1], [2.5, 97.5])
    return float(low), float(high)


def arms_of(summary: Summary) -> list[str]:
    """The arms of all tables: clean, noise, and what was attacked."""
    found = (arm for name in _MEASURES for arm in summary[name])
    return list(dict.fromkeys([*CONTROLS, *found]))


def rows_for_print(summary: Summary) -> Iterable[tuple[str, ...]]:
    """(table, measure, n, a cell for each of `arms_of`) as text, percent with the interval."""
    columns = arms_of(summary)
    for table, measures in _MEASURES.items():
        arms = summary[table]
        for measure in measures if arms else ():
            n = "/".join(sorted({str(arm["n"]) for arm in arms.values()}))
            yield (table, measure, n, *(_cell(arms.get(arm), measure) for arm in columns))


def _cell(arm: dict[str, Any] | None, measure: str) -> str:
    if arm is None:
        return "–"
    low, high = arm[f"{measure}_ci"]
    return f"{100 * arm[measure]:.1f} [{100 * low:.0f}, {100 * high:.0f}]"
