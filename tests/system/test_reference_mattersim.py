"""Candidates, angles and metrics against MatterSim's and HAMT's own output."""

import gzip
import json
import os
from collections import ChainMap
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vlnhijack.errors import InputError
from vlnhijack.navigation.candidates import candidates
from vlnhijack.navigation.episode import load_episodes, save_episodes
from vlnhijack.navigation.graph import GraphFolder, NavigationGraph, load_graph
from vlnhijack.navigation.metrics import path_metrics
from vlnhijack.navigation.views import VIEWS, angle_features, view_angles

SHARED = Path(__file__).resolve().parents[3] / "shared"
REFERENCE = Path(os.environ.get("VLNHIJACK_REFERENCE", SHARED / "reference")) / "mattersim"
R2R = Path(os.environ.get("VLNHIJACK_DATA", SHARED / "data")) / "r2r"
DATA = R2R / "connectivity.tar.gz"
NAMES = {
    "nav_error": "navigation_error",
    "oracle_error": "oracle_error",
    "trajectory_lengths": "path_length",
    "success": "success",
    "spl": "spl",
    "oracle_success": "oracle_success",
    "DTW": "dtw",
    "nDTW": "ndtw",
    "SDTW": "sdtw",
    "CLS": "cls",
}

pytestmark = pytest.mark.skipif(
    not REFERENCE.is_dir(), reason=f"no reference data at {REFERENCE} (VLNHIJACK_REFERENCE)"
)


def read(name: str) -> Any:
    with gzip.open(REFERENCE / name, "rt") as file:
        return json.load(file)


@pytest.fixture(scope="module")
def graphs() -> Mapping[str, NavigationGraph]:
    """Those of the public data set, and those of the reference itself."""
    if not DATA.is_file():
        pytest.skip(f"no connectivity graphs at {DATA} (VLNHIJACK_DATA)")
    return ChainMap(GraphFolder(REFERENCE), GraphFolder(DATA))


def test_views_have_the_simulator_s_angles() -> None:
    views = json.loads((REFERENCE / "views.json").read_text())
    assert len(views) == VIEWS
    for view in views:
        expected = (view["heading"], view["elevation"])
        assert view_angles(view["pointId"]) == pytest.approx(expected, abs=1e-15)


def test_angle_features_are_bit_exact() -> None:
    with np.load(REFERENCE / "angles.npz") as angles:
        reference = angles["angle_feature"]
    ours = np.stack([angle_features(base) for base in range(VIEWS)])
    assert np.array_equal(ours, reference)


def test_candidates_match(graphs: Mapping[str, NavigationGraph]) -> None:
    for scan, viewpoints in read("candidates.json.gz").items():
        ours = candidates(graphs[scan])
        assert set(viewpoints) <= set(ours)
        for viewpoint, expected in viewpoints.items():
            found = ours[viewpoint]
            where = f"{scan} {viewpoint}"
            assert [(c.viewpoint, c.point_id, c.idx) for c in found] == [
                (e["viewpointId"], e["pointId"], e["idx"]) for e in expected
            ], where
            for field, name in (
                ("heading", "normalized_heading"),
                ("elevation", "elevation"),
                ("distance", "distance"),
            ):
                got = np.array([getattr(c, field) for c in found])
                want = np.array([e[name] for e in expected])
                assert np.array_equal(got, want), f"{where} {field}"


def check_scores(graph: NavigationGraph, record: dict[str, Any]) -> None:
    scores = path_metrics(graph, record["prediction"], record["reference"])
    for theirs, ours in NAMES.items():
        want = float(record["scores"][theirs])
        got = getattr(scores, ours)
        assert got == pytest.approx(want, abs=1e-9, nan_ok=True), (record["kind"], ours)


def test_metrics_match(graphs: Mapping[str, NavigationGraph]) -> None:
    for record in read("metrics.json.gz"):
        check_scores(graphs[record["scan"]], record)


def test_metrics_at_the_edges_match_or_explain() -> None:
    for record in read("metrics_edge.json.gz"):
        graph = load_graph(REFERENCE, record["scan"])
        if "error" in record:
            with pytest.raises(InputError, match=record["scan"]):
                path_metrics(graph, record["prediction"], record["reference"])
        else:
            check_scores(graph, record)


def test_room_to_room_loads_unchanged(
    graphs: Mapping[str, NavigationGraph], tmp_path: Path
) -> None:
    source, file = R2R / "R2R_val_seen.json.gz", tmp_path / "R2R_val_seen.json"
    if not source.is_file():
        pytest.skip(f"no Room-to-Room episodes at {source} (VLNHIJACK_DATA)")
    file.write_bytes(gzip.decompress(source.read_bytes()))
    records = json.loads(file.read_text())
    episodes = load_episodes(file, graphs)
    assert [e.instruction for e in episodes] == [t for r in records for t in r["instructions"]]
    save_episodes(tmp_path / "again.json", episodes)
    assert load_episodes(tmp_path / "again.json", graphs) == episodes
