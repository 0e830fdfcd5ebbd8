"""Records of rollouts after a forced guide, and the file they are kept in."""

from pathlib import Path

import pytest

from tests.hamt_by_hand import act
from tests.worlds import World, world
from vlnhijack.errors import InputError
from vlnhijack.evaluation.evaluate import evaluate_instance, navigate
from vlnhijack.evaluation.records import Record, load_records, save_records, to_frame
from vlnhijack.navigation.metrics import path_metrics
from vlnhijack.threat import AttackInstance

WHERE, TRAJECTORY = "east06", ("east02", "east03")


@pytest.fixture(scope="module")
def given() -> World:
    return world()


@pytest.fixture(scope="module")
def instance(given: World) -> AttackInstance:
    through = tuple(e for e in given.episodes if WHERE in e.path)[::4]
    return AttackInstance(
        "a", "east", "chair_0", "chair", WHERE, 0.5, TRAJECTORY, through, through[:2], ()
    )


@pytest.fixture(scope="module")
def records(given: World, instance: AttackInstance) -> list[Record]:
    conditions = {"Train": instance.train, "Validation": instance.validation, "Test": ()}
    return evaluate_instance(
        given.agent, given.table, given.features, instance, "attacked", conditions
    )


def test_a_record_tells_what_the_agent_did_after_its_guide(
    given: World, instance: AttackInstance, records: list[Record]
) -> None:
    graph = given.table.graphs["east"]
    episodes = [*instance.train, *instance.validation]
    assert {1, 2} < {len(record.path) for record in records}
    for record, episode in zip(records, episodes, strict=True):
        at = episode.path.index(WHERE)
        walked = act(given, episode, list(episode.path[: at + 1]))
        assert record.guide == list(episode.path[: at + 1])
        assert record.path == walked[at:]
        assert record.stopped == (len(walked) == at + 1)
        attack = path_metrics(graph, walked[at:], [WHERE, *TRAJECTORY])
        assert record.attack_success == attack.success
        assert record.attack_oracle_success == attack.oracle_success
        assert record.attack_ndtw == attack.ndtw
        original = path_metrics(graph, walked[at:], episode.path[at:])
        assert record.original_success == original.success
        assert record.original_ndtw == original.ndtw
        assert (record.path_id, record.instruction_id) == (episode.path_id, episode.instruction_id)


def test_records_name_their_arm_condition_and_instance(
    instance: AttackInstance, records: list[Record]
) -> None:
    conditions = [record.condition for record in records]
    assert conditions == ["Train"] * len(instance.train) + ["Validation"] * 2
    record = records[0]
    assert (record.instance, record.kind, record.arm) == ("a", "trajectory", "attacked")
    assert (record.scan, record.object, record.category, record.viewpoint) == (
        "east",
        "chair_0",
        "chair",
        WHERE,
    )


def test_navigation_starts_where_the_episode_does(given: World) -> None:
    episodes = given.episodes[::37]
    scores = navigate(given.agent, given.table, given.features, episodes)
    for episode, score in zip(episodes, scores, strict=True):
        walked = act(given, episode, [episode.path[0]])
        expected = path_metrics(given.table.graphs[episode.scan], walked, episode.path)
        assert score == expected


def test_saved_records_load_again(tmp_path: Path, records: list[Record]) -> None:
    frame = to_frame(records)
    save_records(tmp_path / "records.parquet", frame)
    loaded = load_records(tmp_path / "records.parquet")
    rows = loaded.to_dict("records")
    for row, record in zip(rows, records, strict=True):
        row["guide"], row["path"] = list(row["guide"]), list(row["path"])
        assert Record(**row) == record


def test_bad_record_files_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.parquet: expected a Parquet file"):
        load_records(tmp_path / "none.parquet")
    (tmp_path / "text.parquet").write_text("no parquet")
    with pytest.raises(InputError, match=r"text\.parquet: not a Parquet file"):
        load_records(tmp_path / "text.parquet")
