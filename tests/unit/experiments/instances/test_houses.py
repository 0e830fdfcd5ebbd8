"""The rules of an attack instance, on a 4 × 3 grid where every shortest path is an episode."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.grids import grid_graph
from vlnhijack.errors import InputError
from vlnhijack.experiments.config import InstanceRules, PickedInstance
from vlnhijack.experiments.instances.houses import at_place, draw, pick, rendered_places
from vlnhijack.experiments.instances.rules import Place, Scan, build
from vlnhijack.scenes.house import House, HouseObject
from vlnhijack.threat import AttackInstance, guide

CABINET, TABLE = "cabinet_0", "table_0"
AT = "east06"
KINDS = ("single_step", "trajectory")
RULES = InstanceRules(min_train=3, min_test=1)


def rules(**changes: Any) -> InstanceRules:
    return RULES.model_copy(update=changes)


def attempt(
    scan: Scan, kind: Any, viewpoint: str, rules: InstanceRules, seed: int = 0
) -> AttackInstance | None:
    place = next(p for p in scan.places if (p.object_id, p.viewpoint) == (CABINET, viewpoint))
    return build(scan, at_place(scan, kind, place), rules, seed)


def built(scan: Scan, kind: Any, viewpoint: str = AT, seed: int = 0) -> AttackInstance:
    instance = attempt(scan, kind, viewpoint, RULES, seed)
    assert instance is not None
    return instance


def places(
    scan: Scan, kind: Any, rules: InstanceRules = RULES, seed: int = 0
) -> list[AttackInstance]:
    """Every possible instance of the cabinet."""
    found = [attempt(scan, kind, viewpoint, rules, seed) for viewpoint in scan.graph.viewpoints]
    return [instance for instance in found if instance is not None]


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_is_shared_with_test(scan: Scan, kind: Any) -> None:
    for instance in places(scan, kind):
        tested = {tuple(guide(instance, e)) for e in instance.test}
        seen = {tuple(guide(instance, e)) for e in (*instance.train, *instance.validation)}
        assert not tested & seen
        assert set(instance.test) <= set(scan.val_seen)
        assert {*instance.train, *instance.validation} <= set(scan.train)


@pytest.mark.parametrize("kind", KINDS)
def test_train_and_validation_split_by_paths(scan: Scan, kind: Any) -> None:
    for instance in places(scan, kind):
        train, validation = (
            {e.path_id for e in part} for part in (instance.train, instance.validation)
        )
        assert train
        assert not train & validation
        assert len(validation) == np.ceil(0.2 * len(train | validation))


def test_the_seed_splits_the_support(scan: Scan) -> None:
    splits = [built(scan, "single_step", seed=seed) for seed in (0, 0, 1, 2, 3)]
    assert splits[0] == splits[1]
    assert len({split.validation for split in splits}) > 1
    assert len({frozenset({*split.train, *split.validation}) for split in splits}) == 1


def test_single_step_episodes_go_on_from_the_attack_viewpoint(scan: Scan) -> None:
    instance = built(scan, "single_step")
    assert instance.trajectory == ()
    episodes = (*instance.train, *instance.validation, *instance.test)
    assert all(AT in e.path[:-1] for e in episodes)
    assert any(e.path[-1] == AT for e in scan.train)
    expected = {e for e in scan.val_seen if AT in e.path[:-1]}
    assert set(instance.test) == expected


def test_all_the_support_is_used(scan: Scan) -> None:
    instance = built(scan, "single_step")
    tested = {tuple(guide(instance, e)) for e in instance.test}
    expected = [
        e
        for e in scan.train
        if AT in e.path[:-1] and tuple(e.path[: e.path.index(AT) + 1]) not in tested
    ]
    assert len(expected) < sum(AT in e.path[:-1] for e in scan.train), "some were left out"
    assert sorted((*instance.train, *instance.validation), key=str) == sorted(expected, key=str)


@pytest.mark.parametrize("longest", [2, 5])
def test_attack_trajectories_lead_away(scan: Scan, longest: int) -> None:
    graph = scan.graph
    limited = rules(max_steps=longest, target_apart=True, target_off_path=True)
    instances = [i for seed in range(6) for i in places(scan, "trajectory", limited, seed)]
    assert len({(i.viewpoint, i.trajectory) for i in instances}) > 10
    for instance in instances:
        target = instance.trajectory[-1]
        assert instance.target_path == graph.shortest_path(instance.viewpoint, target)
        assert 1 <= len(instance.trajectory) <= longest
        assert graph.distance(instance.viewpoint, target) >= 3
        for episode in instance.test:
            assert graph.distance(target, episode.path[-1]) >= 3
            assert target not in episode.path[episode.path.index(instance.viewpoint) :]


def test_too_few_episodes_give_no_instance(scan: Scan) -> None:
    instance = built(scan, "single_step")
    support = (*instance.train, *instance.validation)
    enough = {
        "min_test": len(instance.test),
        "min_train": len(support),
        "min_paths": len({e.path_id for e in support}),
    }
    for name, count in enough.items():
        exact, more = rules(**{name: count}), rules(**{name: count + 1})
        assert attempt(scan, "single_step", AT, exact) is not None
        assert attempt(scan, "single_step", AT, more) is None, name


@pytest.mark.parametrize(
    ("share", "changes", "allowed"),
    [
        (0.4, {}, True),
        (0.4 - 1e-10, {}, True),
        (0.399, {}, False),
        (0.7, {"min_coverage": 0.7}, True),
        (0.6, {"max_coverage": 0.6}, True),
        (0.601, {"max_coverage": 0.6}, False),
        (0.5, {"categories": ("table",)}, False),
    ],
)
def test_the_object_has_to_fill_its_view(
    scan: Scan, share: float, changes: dict[str, Any], allowed: bool
) -> None:
    scan = replace(scan, places=[Place(CABINET, "cabinet", AT, share)])
    if not allowed:
        with pytest.raises(InputError, match="all there are"):
            draw([scan], "single_step", 1, rules(**changes), seed=0)
        return
    (instance,) = draw([scan], "single_step", 1, rules(**changes), seed=0)
    assert (instance.object_id, instance.viewpoint, instance.category) == (CABINET, AT, "cabinet")
    assert instance.coverage == pytest.approx(share)


@pytest.mark.parametrize("kind", KINDS)
def test_the_seed_draws_the_instances(scan: Scan, kind: Any) -> None:
    everything = rules(min_coverage=0.2)
    first, again, other = (draw([scan], kind, 6, everything, seed) for seed in (1, 1, 2))
    assert first == again
    assert [i.id for i in first] != [i.id for i in other]
    assert {i.object_id for i in first[:2]} == {CABINET, TABLE}, "every object before a second"
    assert len({i.id for i in first}) == 6
    assert draw([scan], kind, 3, everything, seed=1) == first[:3]


def test_more_than_there_are_is_refused(scan: Scan) -> None:
    count = len(places(scan, "single_step"))
    assert len(draw([scan], "single_step", count, RULES, seed=0)) == count
    with pytest.raises(InputError, match=rf"instances\.count: expected ≤ {count}, all there are"):
        draw([scan], "single_step", count + 1, RULES, seed=0)


def picked(**changes: Any) -> PickedInstance:
    given = {"kind": "single_step", "house": "east", "object": CABINET, "viewpoint": AT}
    return PickedInstance.model_validate(given | changes)


def test_a_picked_instance_is_the_one_of_its_place(scan: Scan) -> None:
    assert pick(scan, picked(), RULES, seed=0) == built(scan, "single_step")
    drawn = built(scan, "trajectory")
    wanted = picked(kind="trajectory", target=drawn.trajectory[-1])
    assert pick(scan, wanted, RULES, seed=0) == drawn


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"object": "sofa_9"}, "object: expected one of cabinet_0, table_0, received 'sofa_9'"),
        ({"viewpoint": "nowhere"}, "viewpoint: .*nowhere"),
        ({"kind": "trajectory", "target": "nowhere"}, "viewpoint: .*nowhere"),
        ({"object": TABLE}, "table_0 at east06: expected .*, received 'a table, coverage 0.30"),
        ({"kind": "trajectory", "target": "east07"}, "too few episodes"),
        ({"kind": "trajectory", "target": AT}, "too few episodes"),
    ],
)
def test_a_picked_instance_that_breaks_a_rule_is_refused(
    scan: Scan, changes: dict[str, Any], expected: str
) -> None:
    """east07 is a neighbour of east06, nearer than 3 m."""
    with pytest.raises(InputError, match=f"^east: .*{expected}"):
        pick(scan, picked(**changes), rules(target_apart=True), seed=0)


def test_a_picked_object_is_of_the_categories(scan: Scan) -> None:
    with pytest.raises(InputError, match="received 'a cabinet"):
        pick(scan, picked(), rules(categories=("table",)), seed=0)


def test_what_a_house_shows_is_the_largest_share_of_a_view() -> None:
    """0.7 is no float32 number: the share that is rendered still passes as 0.7."""
    graph = grid_graph("east")
    names = ("cabinet_0", "table_0")
    objects = tuple(HouseObject(n, n[:-2], "room", (0, 0, 0), (1, 1, 1)) for n in names)
    coverage = np.zeros((len(graph.viewpoints), 36, 2), np.float32)
    coverage[3, [7, 8], 1] = (0.7, 0.2)
    places = rendered_places(House("east", "baked", (), objects, (), graph), coverage)
    assert [(p.object_id, p.category, p.viewpoint) for p in places if p.coverage] == [
        ("table_0", "table", graph.viewpoints[3])
    ]
    assert max(place.coverage for place in places) == 0.7
