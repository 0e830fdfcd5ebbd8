from typing import Any

import numpy as np
import pandas as pd
import pytest

from vlnhijack import seeds
from vlnhijack.evaluation.tables import arms_of, interval, rows_for_print, stronger_noise, summarise


def rows(count: int, **changes: Any) -> list[dict[str, Any]]:
    """Hand-made records of one arm and condition."""
    row = {
        "kind": "single_step",
        "scan": "alder",
        "object": "chair_0",
        "arm": "clean",
        "rung": "frozen_16spp",
        "condition": "Test",
        "path_id": 0,
        "stopped": False,
        "attack_success": 0.0,
        "attack_oracle_success": 0.0,
        "attack_ndtw": 0.2,
        "original_success": 1.0,
        "original_ndtw": 0.9,
    }
    return [row | {"path_id": k} | changes for k in range(count)]


def experiment() -> pd.DataFrame:
    """Texel noise is the stronger one for trajectories, block noise for single steps."""
    records = []
    for kind, stops in (("single_step", 1), ("trajectory", 0)):
        base = {"kind": kind}
        records += rows(4, **base)
        records += rows(4, **base, arm="noise_texel", attack_ndtw=0.4)
        records += rows(2, **base, arm="noise_block", attack_ndtw=0.3, stopped=True)
        records += rows(2, **base, arm="noise_block", attack_ndtw=0.3)
        hit = {"attack_success": 1.0, "attack_oracle_success": 1.0, "original_success": 0.0}
        records += rows(3, **base, arm="attacked", stopped=bool(stops), attack_ndtw=0.8, **hit)
        records += rows(1, **base, arm="attacked", attack_oracle_success=1.0, attack_ndtw=0.4)
        records += rows(5, **base, arm="attacked", condition="Train", stopped=True)
        records += rows(20, **base, arm="noise_texel", condition="Train", stopped=True)
    return pd.DataFrame(records)


def test_the_tables_are_the_means_of_condition_test() -> None:
    summary = summarise(experiment())
    single = summary["single_step"]
    assert {arm: (row["n"], row["stop_rate"]) for arm, row in single.items()} == {
        "clean": (4, 0.0),
        "noise": (4, 0.5),
        "attacked": (4, 0.75),
    }
    attacked = summary["trajectory"]["attacked"]
    assert (attacked["n"], attacked["sr"], attacked["osr"]) == (4, 0.75, 1.0)
    assert attacked["ndtw"] == pytest.approx(0.7)
    assert summary["trajectory"]["noise"]["ndtw"] == pytest.approx(0.4)
    original = {arm: (row["n"], row["sr"]) for arm, row in summary["original"].items()}
    assert original == {"clean": (4, 1.0), "noise": (4, 1.0), "attacked": (4, 0.25)}
    assert summary["original"]["clean"]["ndtw"] == pytest.approx(0.9)


def test_every_condition_has_its_tables() -> None:
    summary = summarise(experiment())
    conditions = summary["conditions"]
    assert list(conditions) == ["Train", "Validation", "Test"]
    assert conditions["Test"] == {k: v for k, v in summary.items() if k != "conditions"}
    assert conditions["Train"]["single_step"]["attacked"]["n"] == 5
    assert conditions["Train"]["single_step"]["attacked"]["stop_rate"] == 1
    assert conditions["Validation"]["single_step"] == {}


def test_attacks_of_several_rungs_are_arms_of_their_own() -> None:
    records = experiment()
    attacked = records["arm"] == "attacked"
    several = pd.concat([records, records[attacked].assign(rung="prb_4spp", stopped=False)])
    summary = summarise(several)
    single = summary["single_step"]
    assert {arm: (row["n"], row["stop_rate"]) for arm, row in single.items()} == {
        "clean": (4, 0.0),
        "noise": (4, 0.5),
        "frozen_16spp": (4, 0.75),
        "prb_4spp": (4, 0.0),
    }
    assert arms_of(summary) == ["clean", "noise", "frozen_16spp", "prb_4spp"]
    assert all(len(row) == 3 + 4 for row in rows_for_print(summary))


def test_the_noise_that_is_stronger_on_test_counts_for_each_kind() -> None:
    kept = stronger_noise(experiment())
    assert set(kept["arm"]) == {"clean", "noise", "attacked"}
    noise = kept[kept["arm"] == "noise"]
    single, trajectory = (noise[noise["kind"] == k] for k in ("single_step", "trajectory"))
    assert len(single) == 4, "block noise, which has no Train records"
    assert list(trajectory["condition"]) == ["Test"] * 4 + ["Train"] * 20


def test_an_interval_contains_the_mean_and_shrinks_with_n() -> None:
    random = seeds.stream(0, "intervals")
    widths = []
    for count in (40, 1000):
        stopped = random.random(count) < 0.3
        records = pd.DataFrame(rows(count)).assign(stopped=stopped)
        low, high = interval(records, "stopped")
        assert low <= stopped.mean() <= high
        expected = 2 * 1.96 * np.sqrt(stopped.var() / count)
        assert high - low == pytest.approx(expected, rel=0.12)
        widths.append(high - low)
    assert widths[1] < widths[0] / 3


@pytest.mark.parametrize("same_name", [False, True])
def test_objects_are_clusters(same_name: bool) -> None:
    """10 objects whose 20 records agree count as 10 observations, not as 200."""
    records = []
    for k in range(10):
        name = "chair_0" if same_name else f"chair_{k}"
        records += rows(20, scan=f"house_{k}", object=name, stopped=k % 2 == 0)
    frame = pd.DataFrame(records)
    alone = interval(frame.assign(object="chair_0", scan="one", path_id=range(200)), "stopped")
    low, high = interval(frame, "stopped")
    assert alone[1] - alone[0] == pytest.approx(2 * 1.96 * np.sqrt(0.25 / 200), rel=0.2)
    assert high - low == pytest.approx(2 * 1.96 * np.sqrt(0.25 / 10), rel=0.2)


def test_paths_are_clusters_of_a_single_object() -> None:
    frame = pd.DataFrame([row for k in range(10) for row in rows(10, stopped=k < 5)])
    same = interval(frame.assign(path_id=np.repeat(np.arange(10), 10)), "stopped")
    alone = interval(frame.assign(path_id=range(100)), "stopped")
    assert same[1] - same[0] > 2 * (alone[1] - alone[0])


def test_printed_rows_are_percent_with_their_interval() -> None:
    records = experiment()
    printed = list(rows_for_print(summarise(records[records["kind"] == "single_step"])))
    assert printed[0][:4] == ("single_step", "stop_rate", "4", "0.0 [0, 0]")
    assert printed[0][5].startswith("75.0 [")
    assert len(printed) == 1, "no trajectory attacks, no rows"
    without_noise = records[~records["arm"].str.startswith("noise")]
    assert all(row[4] == "–" for row in rows_for_print(summarise(without_noise)))
