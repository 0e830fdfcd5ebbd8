"""Data sets on disk become scans, and the command makes instances of them."""

import gzip
import json
import tarfile
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from typer.testing import CliRunner

from tests.grids import grid_graph
from vlnhijack.cli import app
from vlnhijack.errors import InputError
from vlnhijack.experiments.config import DatasetInstances, StoredInstances
from vlnhijack.experiments.instances.datasets import load_scans
from vlnhijack.experiments.instances.files import load_instances, save_instances
from vlnhijack.experiments.instances.paths import construct
from vlnhijack.experiments.instances.rules import Place, Scan
from vlnhijack.navigation.episode import Episode, save_episodes
from vlnhijack.navigation.graph import save_graph

TABLE = "index\traw_category\tmpcat40\n1\tcouch\tsofa\n2\tdining table\ttable\n"
BOXES = {
    "east_east05": {"3": {"name": "couch", "visible_pos": [4], "bbox2d": [[0, 0, 640, 240]]}},
    "east_east06": {"8": {"name": "dining#table", "visible_pos": [], "bbox2d": []}},
}


def settings(**changes: Any) -> DatasetInstances:
    return DatasetInstances.model_validate(changes)


def save_rxr(file: Path, episodes: list[Episode]) -> None:
    records = [
        {
            "path_id": e.path_id,
            "instruction_id": int(e.instruction_id.split("_")[1]) + 10 * e.path_id,
            "scan": e.scan,
            "path": e.path,
            "heading": e.heading,
            "instruction": e.instruction,
            "language": ("en-US", "en-IN", "hi-IN")[int(e.instruction_id[-1])],
        }
        for e in episodes
    ]
    file.write_bytes(gzip.compress("\n".join(map(json.dumps, records)).encode()))


@pytest.fixture(scope="module")
def data(scan: Scan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """R2R flat, with everything beside it; RxR in HAMT's folders."""
    folder = tmp_path_factory.mktemp("data")
    (folder / "RxR" / "annotations").mkdir(parents=True)
    for split, episodes in (("train", scan.train), ("val_seen", scan.val_seen)):
        save_episodes(folder / f"R2R_{split}.json", episodes)
        save_rxr(folder / "RxR" / "annotations" / f"rxr_{split}_guide.jsonl.gz", list(episodes))
    for name in ("east", "west"):
        save_graph(grid_graph(name), folder / "R2R" / "connectivity")
    with tarfile.open(folder / "connectivity.tar.gz", "w:gz") as archive:
        archive.add(folder / "R2R" / "connectivity", "connectivity")
    (folder / "reverie_boxes_v1.json").write_text(json.dumps(BOXES))
    (folder / "category_mapping.tsv").write_text(TABLE)
    return folder


def test_a_flat_folder_is_found(data: Path, scan: Scan) -> None:
    (loaded,) = load_scans(data, settings())
    assert loaded.graph.viewpoints == scan.graph.viewpoints
    assert [e.instruction for e in loaded.train] == [e.instruction for e in scan.train]
    assert [e.path for e in loaded.val_seen] == [e.path for e in scan.val_seen]
    assert loaded.places == [
        Place("3", "sofa", "east05", 0.5),
        Place("8", "table", "east06", 0.0),
    ]


def test_names_may_be_the_categories(data: Path) -> None:
    (loaded,) = load_scans(data, settings(category_map="name"))
    assert [place.category for place in loaded.places] == ["couch", "dining_table"]


def test_hamts_folders_are_found(data: Path, scan: Scan) -> None:
    files = {
        "boxes": str(data / "reverie_boxes_v1.json"),
        "categories": str(data / "category_mapping.tsv"),
    }
    for languages, count in (((), 3), (("en",), 2), (("hi-IN",), 1)):
        chosen = settings(dataset="rxr", files=files, languages=languages)
        (loaded,) = load_scans(data / "RxR", chosen)
        assert 3 * len(loaded.train) == count * len(scan.train)


def test_a_name_without_a_category_is_refused(data: Path, tmp_path: Path) -> None:
    (tmp_path / "table.tsv").write_text(TABLE.replace("couch", "sofa"))
    with pytest.raises(InputError, match="east_east05: 3: name: expected .*, received 'couch'"):
        load_scans(data, settings(files={"categories": str(tmp_path / "table.tsv")}))


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="connectivity: expected connectivity or connectivity.tar"):
        load_scans(tmp_path, settings())
    save_graph(grid_graph("east"), tmp_path / "connectivity")
    with pytest.raises(InputError, match="train: expected R4R_train_enc.json or R4R_train.json"):
        load_scans(tmp_path, settings(dataset="r4r"))


def run(*arguments: str) -> Any:
    return CliRunner().invoke(app, ["instances", *arguments])


def test_the_command_writes_both_files(data: Path, tmp_path: Path) -> None:
    out = tmp_path / "sets" / "inst.parquet"
    done = run("--data", str(data), "--out", str(out), "--json")
    summary = json.loads(done.stdout)
    assert summary["by_category"] == {"sofa": summary["instances"]}
    assert summary["instances"] > 10
    rows = pd.read_parquet(out)
    assert len(rows) == summary["instances"]
    assert rows["attack"].nunique() == summary["paths"]
    whole = json.loads(out.with_suffix(".json").read_text())
    assert whole["summary"] == summary
    assert whole["settings"] == settings().model_dump(mode="json")
    train = [e["instruction_id"] for attack in whole["attacks"] for e in attack["train"]]
    assert len(train) == summary["train_episodes"]
    assert len(load_instances(out.with_suffix(".json"))) == summary["paths"]
    assert train == [name for names in rows.drop_duplicates("attack")["train"] for name in names]


def test_the_command_takes_settings(data: Path, tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_text("kind: single_step\nrules: {min_coverage: 0.6}\n")
    none = json.loads(run("--data", str(data), "--config", f"{tmp_path}/own.yaml", "--json").stdout)
    assert none["instances"] == 0
    override = ("--config", f"{tmp_path}/own.yaml", "--set", "rules.min_coverage=0.5")
    done = run("--data", str(data), *override)
    assert "instances of sofa" in done.stdout


def test_an_experiment_reads_the_attacks(scan: Scan, tmp_path: Path) -> None:
    attacks = construct([scan], settings())
    save_instances(tmp_path / "a.parquet", attacks, settings())
    stored = StoredInstances(file=str(tmp_path / "a.json"))
    assert load_instances(Path(stored.file)) == attacks
    (tmp_path / "bad.json").write_text(json.dumps({"settings": {}, "summary": {}, "attacks": [1]}))
    with pytest.raises(InputError, match=r"bad.json: attacks\.0: "):
        load_instances(tmp_path / "bad.json")


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("--dataset", "r2d2"), "dataset: expected 'r2r', 'r4r', 'rxr' or 'houses', received"),
        (("--set", "rules.minimum=1"), "rules.minimum: expected no such key, received 1"),
        (("--out", "inst.csv"), "inst.csv: expected a name that ends in .parquet"),
        (("--visibility", "masks"), "masks: expected houses of the data set's scans"),
    ],
)
def test_bad_options_end_in_one_line(data: Path, arguments: tuple[str, ...], expected: str) -> None:
    done = run("--data", str(data), *arguments)
    assert done.exit_code == 1
    assert expected in done.stderr
    assert done.stderr.count("\n") == 1
