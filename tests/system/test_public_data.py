"""The readers and the instance construction on the public annotations."""

import gzip
import json
import os
import resource
import subprocess
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

import pytest

from vlnhijack.experiments.config import DatasetInstances
from vlnhijack.experiments.instances.datasets import load_scans
from vlnhijack.experiments.instances.files import summarise
from vlnhijack.experiments.instances.paths import construct
from vlnhijack.experiments.instances.rules import Scan
from vlnhijack.threat import AttackInstance

SHARED = Path(__file__).resolve().parents[3] / "shared"
R2R = Path(os.environ.get("VLNHIJACK_DATA", SHARED / "data")) / "r2r"
NEEDED = ("R2R_train.json.gz", "R2R_val_seen.json.gz", "reverie_boxes_v1.json.gz")
LIMIT_S = 20

pytestmark = pytest.mark.skipif(
    not all((R2R / name).is_file() for name in NEEDED),
    reason=f"no public annotations at {R2R} (VLNHIJACK_DATA)",
)


def read(name: str) -> Any:
    with gzip.open(R2R / name, "rt") as file:
        return json.load(file)


@pytest.fixture(scope="module")
def scans() -> list[Scan]:
    return load_scans(R2R, DatasetInstances())


@pytest.fixture(scope="module")
def attacks(scans: list[Scan]) -> list[AttackInstance]:
    return construct(scans, DatasetInstances())


def test_everything_is_read(scans: list[Scan]) -> None:
    wanted = {record["scan"] for record in read("R2R_val_seen.json.gz")}
    assert [scan.graph.scan for scan in scans] == sorted(wanted)
    for split, name in (("train", NEEDED[0]), ("val_seen", NEEDED[1])):
        episodes = [e for scan in scans for e in getattr(scan, split)]
        written = [
            (record["path_id"], tuple(record["path"]), text)
            for record in read(name)
            if record["scan"] in wanted
            for text in record["instructions"]
        ]
        assert sorted((e.path_id, e.path, e.instruction) for e in episodes) == sorted(written)


def test_places_are_reveries_largest_boxes(scans: list[Scan]) -> None:
    boxes = read("reverie_boxes_v1.json.gz")
    found = {
        (f"{scan.graph.scan}_{place.viewpoint}", place.object_id): place.coverage
        for scan in scans
        for place in scan.places
    }
    names = tuple(scan.graph.scan for scan in scans)
    expected = {
        (key, object_id): max([w * h / 307200 for _, _, w, h in entry["bbox2d"]], default=0)
        for key, objects in boxes.items()
        if key.startswith(names)
        for object_id, entry in objects.items()
    }
    assert found == pytest.approx(expected)


def test_attack_viewpoints_are_those_of_a_plain_count(
    scans: list[Scan], attacks: list[AttackInstance]
) -> None:
    """The rules once more, straight from the files; whose categories come from the scans."""
    large = defaultdict(list)
    for scan in scans:
        for place in scan.places:
            if place.category in ("chair", "cabinet", "table", "plant", "sofa", "tv_monitor"):
                large[scan.graph.scan, place.viewpoint].append(place.coverage)
    passing = defaultdict(list)
    for record in read("R2R_train.json.gz"):
        for viewpoint in set(record["path"]):
            passing[record["scan"], viewpoint].append(record)
    expected = {}
    for record in read("R2R_val_seen.json.gz"):
        path, best = record["path"], 0.4
        for at in path:
            share = max(large[record["scan"], at], default=0)
            way = path[: path.index(at) + 1]
            others = [
                other
                for other in passing[record["scan"], at]
                if other["path"][: other["path"].index(at) + 1] != way
            ]
            episodes = sum(len(other["instructions"]) for other in others)
            enough = episodes >= 5 and len(others) >= 2
            if enough and (share > best or share == best == 0.4):
                best, expected[record["path_id"]] = share, (at, episodes)
    assert {
        attack.test[0].path_id: (attack.viewpoint, len(attack.train) + len(attack.validation))
        for attack in attacks
    } == expected


def test_the_command_prints_the_counts_alone(attacks: list[AttackInstance], tmp_path: Path) -> None:
    out = tmp_path / "inst.parquet"
    command = (
        "from vlnhijack.cli import app; "
        f"app(['instances', '--dataset', 'r2r', '--data', {str(R2R)!r}, "
        f"'--visibility', 'reverie-boxes', '--out', {str(out)!r}, '--json'])"
    )
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    done = subprocess.run([sys.executable, "-c", command], capture_output=True, check=True)
    taken = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    assert json.loads(done.stdout) == summarise(attacks)
    assert out.is_file()
    assert out.with_suffix(".json").is_file()
    assert taken <= LIMIT_S
