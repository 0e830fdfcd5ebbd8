"""Attack instances of a house: which object, where, with which episodes (paper, section 3.2)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vlnhijack import seeds
from vlnhijack.errors import InputError
from vlnhijack.experiments.config import InstanceRules, Kind, PickedInstance
from vlnhijack.navigation.episode import Episode
from vlnhijack.scenes.house import House
from vlnhijack.threat import AttackInstance

_FLOAT32 = 1e-6  # more than the rounding of a share of a view


@dataclass(frozen=True, eq=False)
class Scan:
    """A house with what decides its attack instances.

    coverage (M,36,O): share of every view that each object fills.
    """

    house: House
    coverage: NDArray[np.float32]
    train: Sequence[Episode]
    val_seen: Sequence[Episode]

    def largest(self, object_id: str, viewpoint: str) -> float:
        """The largest share of a view at the viewpoint that the object fills."""
        column = [item.id for item in self.house.objects].index(object_id)
        return float(self.coverage[self.house.graph.row(viewpoint), :, column].max())


def draw(
    scans: Sequence[Scan], kind: Kind, count: int, rules: InstanceRules, seed: int
) -> list[AttackInstance]:
    """`count` instances in seeded order: at most one per object until every object has one.

    Raises InputError where fewer are possible.
    """
    places = [(scan, *place) for scan in scans for place in _places(scan, rules)]
    order = seeds.stream(seed, "instances", kind).permutation(len(places))
    instances: list[AttackInstance] = []
    used: set[tuple[str, str]] = set()
    later = []
    for row in order:
        if len(instances) == count:
            break
        scan, object_id, viewpoint = places[row]
        if (scan.house.name, object_id) in used:
            later.append(places[row])
            continue
        instance = build(scan, kind, object_id, viewpoint, rules, seed)
        if instance is not None:
            used.add((scan.house.name, object_id))
            instances.append(instance)
    for scan, object_id, viewpoint in later:
        if len(instances) >= count:
            break
        instance = build(scan, kind, object_id, viewpoint, rules, seed)
        instances += [instance] if instance is not None else []
    if len(instances) < count:
        raise InputError(
            field="instances.count", expected=f"≤ {len(instances)}, all there are", received=count
        )
    return instances[:count]


def pick(scan: Scan, picked: PickedInstance, rules: InstanceRules, seed: int) -> AttackInstance:
    """The instance named in an experiment file; InputError where it breaks a rule."""
    category = scan.house.object(picked.object).category
    scan.house.graph.row(picked.viewpoint)
    if picked.target is not None:
        scan.house.graph.row(picked.target)
    instance = build(scan, picked.kind, picked.object, picked.viewpoint, rules, seed, picked.target)
    coverage = scan.largest(picked.object, picked.viewpoint)
    if instance is None or (picked.object, picked.viewpoint) not in _places(scan, rules):
        raise InputError(
            file=scan.house.name,
            field=f"instance {picked.object} at {picked.viewpoint}",
            expected=f"category, coverage and episodes within the rules ({rules})",
            received=f"a {category}, coverage {coverage:.2f}, or too few episodes",
        )
    return instance


def build(
    scan: Scan,
    kind: Kind,
    object_id: str,
    viewpoint: str,
    rules: InstanceRules,
    seed: int,
    target: str | None = None,
) -> AttackInstance | None:
    """The instance at a place, or None where its episodes are too few.

    Without a target the attack trajectory's end is drawn by the seed among those that fit.
    """
    name = f"{scan.house.name}-{object_id}-{viewpoint[:8]}-{kind}"
    test = [e for e in _through(scan.val_seen, viewpoint) if _usable(e, viewpoint, kind)]
    trajectory: tuple[str, ...] = ()
    if kind == "trajectory":
        among = scan.house.graph.viewpoints if target is None else (target,)
        chosen = _draw_target(scan, viewpoint, among, test, rules, seeds.integer(seed, name))
        if chosen is None:
            return None
        trajectory = tuple(scan.house.graph.shortest_path(viewpoint, chosen)[1:])
        test = [e for e in test if _target_fits(scan, e, viewpoint, chosen, rules)]
    guides = {_guide(e, viewpoint) for e in test}
    support = [
        e
        for e in _through(scan.train, viewpoint)
        if _usable(e, viewpoint, kind) and _guide(e, viewpoint) not in guides
    ]
    paths = sorted({e.path_id for e in support})
    if len(test) < rules.min_test or len(support) < rules.min_train or len(paths) < rules.min_paths:
        return None
    held_out = _held_out(paths, rules.validation, seeds.integer(seed, name, "split"))
    return AttackInstance(
        id=name,
        scan=scan.house.name,
        object_id=object_id,
        category=scan.house.object(object_id).category,
        viewpoint=viewpoint,
        coverage=scan.largest(object_id, viewpoint),
        trajectory=trajectory,
        train=tuple(e for e in support if e.path_id not in held_out),
        validation=tuple(e for e in support if e.path_id in held_out),
        test=tuple(test),
    )


def _places(scan: Scan, rules: InstanceRules) -> list[tuple[str, str]]:
    return [
        (item.id, viewpoint)
        for column, item in enumerate(scan.house.objects)
        if item.category in rules.categories
        for row, viewpoint in enumerate(scan.house.graph.viewpoints)
        if _fills(float(scan.coverage[row, :, column].max()), rules)
    ]


def _fills(coverage: float, rules: InstanceRules) -> bool:
    return rules.min_coverage - _FLOAT32 <= coverage <= rules.max_coverage + _FLOAT32


def _through(episodes: Sequence[Episode], viewpoint: str) -> list[Episode]:
    return [episode for episode in episodes if viewpoint in episode.path]


def _usable(episode: Episode, viewpoint: str, kind: Kind) -> bool:
    return kind == "trajectory" or episode.path[-1] != viewpoint


def _guide(episode: Episode, viewpoint: str) -> tuple[str, ...]:
    return episode.path[: episode.path.index(viewpoint) + 1]


def _target_fits(
    scan: Scan, episode: Episode, viewpoint: str, target: str, rules: InstanceRules
) -> bool:
    rest = episode.path[episode.path.index(viewpoint) :]
    far = scan.house.graph.distance(target, episode.path[-1]) >= rules.target_distance
    return far and target not in rest


def _draw_target(
    scan: Scan,
    viewpoint: str,
    among: Sequence[str],
    test: Sequence[Episode],
    rules: InstanceRules,
    seed: int,
) -> str | None:
    graph = scan.house.graph
    fitting = [
        target
        for target in among
        if graph.distance(viewpoint, target) >= rules.target_distance
        and len(graph.shortest_path(viewpoint, target)) - 1 <= rules.max_steps
        and sum(_target_fits(scan, e, viewpoint, target, rules) for e in test) >= rules.min_test
    ]
    if not fitting:
        return None
    return fitting[seeds.stream(seed, "target").integers(len(fitting))]


def _held_out(paths: Sequence[int], share: float, seed: int) -> set[int]:
    count = min(int(np.ceil(share * len(paths))), len(paths) - 1)
    order = seeds.stream(seed, "validation").permutation(len(paths))
    return {paths[row] for row in order[:count]}
