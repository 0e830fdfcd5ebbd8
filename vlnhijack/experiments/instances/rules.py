"""The rules that every attack instance fulfils, whatever its scan comes from."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vlnhijack import seeds
from vlnhijack.experiments.config import InstanceRules, Kind
from vlnhijack.navigation.episode import Episode
from vlnhijack.navigation.graph import NavigationGraph
from vlnhijack.threat import AttackInstance

_TOLERANCE = 1e-9


@dataclass(frozen=True)
class Place:
    """An object at a viewpoint; coverage: the largest share of one of the 36 views it fills."""

    object_id: str
    category: str
    viewpoint: str
    coverage: float


@dataclass(frozen=True, eq=False)
class Scan:
    """What decides the attack instances of a scan: its graph, what is seen where, its episodes."""

    graph: NavigationGraph
    places: Sequence[Place]
    train: Sequence[Episode]
    val_seen: Sequence[Episode]

    @cached_property
    def places_at(self) -> dict[str, list[Place]]:
        """Places by viewpoint."""
        found: dict[str, list[Place]] = {}
        for place in self.places:
            found.setdefault(place.viewpoint, []).append(place)
        return found

    @cached_property
    def train_through(self) -> dict[str, list[Episode]]:
        """Training episodes by each viewpoint that they pass."""
        passing: dict[str, list[Episode]] = {name: [] for name in self.graph.viewpoints}
        for episode in self.train:
            for viewpoint in dict.fromkeys(episode.path):
                passing[viewpoint].append(episode)
        return passing


@dataclass(frozen=True)
class Attempt:
    """An attack that may become an instance.

    test: the episodes to hijack; target: last viewpoint of the attack trajectory, drawn if None.
    """

    id: str
    kind: Kind
    place: Place
    test: Sequence[Episode]
    target: str | None = None


def build(scan: Scan, attempt: Attempt, rules: InstanceRules, seed: int) -> AttackInstance | None:
    """The instance of an attempt, or None where it breaks a rule."""
    place, viewpoint = attempt.place, attempt.place.viewpoint
    test = [e for e in attempt.test if _usable(e, viewpoint, attempt.kind)]
    own_seed = seeds.integer(seed, attempt.id)
    trajectory: tuple[str, ...] = ()
    if attempt.kind == "trajectory":
        chosen = _draw_target(scan.graph, attempt, test, rules, own_seed)
        if chosen is None:
            return None
        trajectory = tuple(scan.graph.shortest_path(viewpoint, chosen)[1:])
        test = [e for e in test if _target_fits(scan.graph, e, viewpoint, chosen, rules)]
    train = [e for e in support(scan, viewpoint, test) if _usable(e, viewpoint, attempt.kind)]
    if len(test) < rules.min_test or not supported(train, rules):
        return None
    held_out = _held_out(train, rules.validation, seeds.integer(seed, attempt.id, "split"))
    return AttackInstance(
        id=attempt.id,
        scan=scan.graph.scan,
        object_id=place.object_id,
        category=place.category,
        viewpoint=viewpoint,
        coverage=place.coverage,
        trajectory=trajectory,
        train=tuple(e for e in train if e.path_id not in held_out),
        validation=tuple(e for e in train if e.path_id in held_out),
        test=tuple(test),
    )


def attackable(place: Place, rules: InstanceRules) -> bool:
    """Whether the object is of the categories and large enough in a view, but not too large."""
    low, high = rules.min_coverage - _TOLERANCE, rules.max_coverage + _TOLERANCE
    return place.category in rules.categories and low <= place.coverage <= high


def support(scan: Scan, viewpoint: str, test: Sequence[Episode]) -> list[Episode]:
    """Training episodes through the viewpoint whose guide trajectory is no test episode's."""
    guides = {_guide(e, viewpoint) for e in test}
    return [e for e in scan.train_through[viewpoint] if _guide(e, viewpoint) not in guides]


def supported(train: Sequence[Episode], rules: InstanceRules) -> bool:
    """Whether there are enough training episodes, on enough paths."""
    return len(train) >= rules.min_train and len({e.path_id for e in train}) >= rules.min_paths


def _usable(episode: Episode, viewpoint: str, kind: Kind) -> bool:
    return kind == "trajectory" or episode.path[-1] != viewpoint


def _guide(episode: Episode, viewpoint: str) -> tuple[str, ...]:
    return episode.path[: episode.path.index(viewpoint) + 1]


def _draw_target(
    graph: NavigationGraph,
    attempt: Attempt,
    test: Sequence[Episode],
    rules: InstanceRules,
    seed: int,
) -> str | None:
    viewpoint = attempt.place.viewpoint
    paths = graph.shortest_paths(viewpoint)
    fitting = [
        target
        for target in graph.viewpoints
        if attempt.target in (None, target)
        and target in paths
        and 1 <= len(paths[target]) - 1 <= rules.max_steps
        and _far_enough(graph, viewpoint, target, rules)
        and sum(_target_fits(graph, e, viewpoint, target, rules) for e in test) >= rules.min_test
    ]
    if not fitting:
        return None
    return fitting[seeds.stream(seed, "target").integers(len(fitting))]


def _far_enough(graph: NavigationGraph, viewpoint: str, target: str, rules: InstanceRules) -> bool:
    return not rules.target_apart or graph.distance(viewpoint, target) >= rules.target_distance


def _target_fits(
    graph: NavigationGraph, episode: Episode, viewpoint: str, target: str, rules: InstanceRules
) -> bool:
    rest = episode.path[episode.path.index(viewpoint) :]
    far = graph.distance(target, episode.path[-1]) >= rules.target_distance
    return far and not (rules.target_off_path and target in rest)


def _held_out(train: Sequence[Episode], share: float, seed: int) -> set[int]:
    paths = sorted({e.path_id for e in train})
    count = min(int(np.ceil(share * len(paths) - _TOLERANCE)), len(paths) - 1)
    order = seeds.stream(seed, "validation").permutation(len(paths))
    return {paths[row] for row in order[:count]}
