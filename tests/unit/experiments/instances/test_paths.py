"""The paper's construction, on the grid whose every fifth shortest path is val_seen."""

from dataclasses import replace
from typing import Any

import pytest

from vlnhijack.experiments.config import DatasetInstances
from vlnhijack.experiments.instances.files import summarise
from vlnhijack.experiments.instances.paths import attack_place, construct
from vlnhijack.experiments.instances.rules import Place, Scan
from vlnhijack.navigation.episode import Episode

KINDS = ("single_step", "trajectory")


def settings(**changes: Any) -> DatasetInstances:
    return DatasetInstances.model_validate(changes)


def first_path(scan: Scan) -> list[Episode]:
    return [e for e in scan.val_seen if e.path_id == scan.val_seen[0].path_id]


@pytest.mark.parametrize("kind", KINDS)
def test_an_attack_is_on_all_instructions_of_one_path(scan: Scan, kind: Any) -> None:
    attacks = construct([scan], settings(kind=kind))
    paths = [attack.test[0].path_id for attack in attacks]
    assert len(set(paths)) == len(paths) > 5
    for attack in attacks:
        same = [e for e in scan.val_seen if e.path_id == attack.test[0].path_id]
        assert list(attack.test) == same
        assert attack.kind == kind


@pytest.mark.parametrize("kind", KINDS)
def test_support_passes_the_viewpoint_on_another_way(scan: Scan, kind: Any) -> None:
    for attack in construct([scan], settings(kind=kind)):
        at, test = attack.viewpoint, attack.test[0]
        way = test.path[: test.path.index(at) + 1]
        expected = {
            e
            for e in scan.train
            if at in e.path
            and e.path[: e.path.index(at) + 1] != way
            and (kind == "trajectory" or e.path[-1] != at)
        }
        assert {*attack.train, *attack.validation} == expected
        assert len(expected) >= 5


def test_the_object_that_fills_a_view_most_decides(scan: Scan) -> None:
    path = first_path(scan)
    viewpoints = path[0].path
    places = [Place("table_0", "table", viewpoint, 0.41) for viewpoint in viewpoints]
    places.append(Place("sofa_1", "sofa", viewpoints[1], 0.8))
    places.append(Place("lamp_1", "lamp", viewpoints[0], 0.9))
    assert attack_place(replace(scan, places=places), path, settings()) == places[-2]
    tied = replace(scan, places=places[:-2])
    assert attack_place(tied, path, settings()) == places[0]


@pytest.mark.parametrize(("end", "key"), [(0, "first_viewpoint"), (-1, "last_viewpoint")])
def test_the_ends_of_a_path_may_be_left_out(scan: Scan, end: int, key: str) -> None:
    path = first_path(scan)
    only = replace(scan, places=[Place("sofa_1", "sofa", path[0].path[end], 0.8)])
    assert attack_place(only, path, settings()) == only.places[0]
    assert attack_place(only, path, settings(**{key: False})) is None


def test_single_step_sets_leave_out_what_ends_at_the_viewpoint(scan: Scan) -> None:
    """The attack viewpoint is the same for both kinds; paths that end there give no attack."""
    places = [p for p in scan.places if p.viewpoint == first_path(scan)[0].path[-1]]
    scan = replace(scan, places=places)
    trajectory = construct([scan], settings())
    single = construct([scan], settings(kind="single_step"))
    ending = [attack for attack in trajectory if attack.test[0].path[-1] == attack.viewpoint]
    assert ending
    assert {a.test[0].path_id for a in single} <= {
        a.test[0].path_id for a in trajectory if a not in ending
    }
    for attack in single:
        assert all(e.path[-1] != attack.viewpoint for e in (*attack.train, *attack.validation))


def test_targets_are_far_from_the_goal_and_near_enough(scan: Scan) -> None:
    graph = scan.graph
    attacks = [a for seed in range(4) for a in construct([scan], settings(seed=seed))]
    assert any(a.trajectory[-1] in a.test[0].path for a in attacks), "allowed by default"
    assert any(graph.distance(a.viewpoint, a.trajectory[-1]) < 3 for a in attacks), "allowed too"
    for attack in attacks:
        assert graph.distance(attack.trajectory[-1], attack.test[0].path[-1]) >= 3
        assert 1 <= len(attack.trajectory) <= 5
        assert attack.target_path == graph.shortest_path(attack.viewpoint, attack.trajectory[-1])
    strict = {"target_apart": True, "target_off_path": True}
    for attack in construct([scan], settings(rules=strict)):
        rest = attack.test[0].path[attack.test[0].path.index(attack.viewpoint) :]
        assert attack.trajectory[-1] not in rest
        assert graph.distance(attack.viewpoint, attack.trajectory[-1]) >= 3


def test_the_seed_draws_targets_and_splits(scan: Scan) -> None:
    runs = [construct([scan], settings(seed=seed)) for seed in (0, 0, 1)]
    assert runs[0] == runs[1] != runs[2]
    assert [a.viewpoint for a in runs[0]] == [a.viewpoint for a in runs[2]]


def test_each_instruction_may_have_its_own_attack(scan: Scan) -> None:
    shared, own = (construct([scan], settings(per_instruction=each)) for each in (False, True))
    assert [e for a in shared for e in a.test] == [e for a in own for e in a.test]
    assert all(len(a.test) == 1 for a in own)
    assert len({a.id for a in own}) == len(own)
    counts, own_counts = summarise(shared), summarise(own)
    assert own_counts["instances"] == counts["instances"]
    both = ("train_episodes", "validation_episodes")
    assert sum(own_counts[k] for k in both) == 3 * sum(counts[k] for k in both)


def test_a_cap_keeps_so_many_objects(scan: Scan) -> None:
    places = [
        replace(place, object_id=f"sofa_{number}", category="sofa")
        for number, place in enumerate(scan.places)
    ]
    scan = replace(scan, places=[replace(place, coverage=0.5) for place in places])
    everything = construct([scan], settings())
    capped = construct([scan], settings(max_objects=2))
    assert summarise(capped)["objects"] == 2 < summarise(everything)["objects"]
    objects = {attack.object_id for attack in capped}
    assert capped == [attack for attack in everything if attack.object_id in objects]


def test_the_summary_counts(scan: Scan) -> None:
    attacks = construct([scan], settings())
    assert summarise(attacks) == {
        "instances": 3 * len(attacks),
        "paths": len(attacks),
        "objects": 1,
        "environments": 1,
        "train_episodes": sum(len(a.train) for a in attacks),
        "validation_episodes": sum(len(a.validation) for a in attacks),
        "by_category": {"cabinet": 3 * len(attacks)},
    }
    assert summarise([])["instances"] == 0
