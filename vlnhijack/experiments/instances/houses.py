"""Attack instances of shipped houses: drawn by the seed among all places, or picked by hand.

Unlike the paper's (`paths`), an instance is tested on every val_seen episode through its viewpoint.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vlnhijack import seeds
from vlnhijack.errors import InputError
from vlnhijack.experiments.config import InstanceRules, Kind, PickedInstance
from vlnhijack.experiments.instances.rules import Attempt, Place, Scan, attackable, build
from vlnhijack.scenes.house import House
from vlnhijack.threat import AttackInstance


def rendered_places(house: House, coverage: NDArray[np.float32]) -> list[Place]:
    """What the views of a house show; coverage (M,36,O): share of every view an object fills."""
    largest = coverage.max(axis=1)
    return [
        Place(item.id, item.category, viewpoint, round(float(largest[row, column]), 6))
        for column, item in enumerate(house.objects)
        for row, viewpoint in enumerate(house.graph.viewpoints)
    ]


def draw(
    scans: Sequence[Scan], kind: Kind, count: int, rules: InstanceRules, seed: int
) -> list[AttackInstance]:
    """`count` instances in seeded order: at most one per object until every object has one.

    Raises InputError where fewer are possible.
    """
    places = [(s, place) for s in scans for place in s.places if attackable(place, rules)]
    order = seeds.stream(seed, "instances", kind).permutation(len(places))
    instances: list[AttackInstance] = []
    used: set[tuple[str, str]] = set()
    later = []
    for row in order:
        if len(instances) == count:
            break
        scan, place = places[row]
        if (scan.graph.scan, place.object_id) in used:
            later.append(places[row])
            continue
        instance = build(scan, at_place(scan, kind, place), rules, seed)
        if instance is not None:
            used.add((scan.graph.scan, place.object_id))
            instances.append(instance)
    for scan, place in later:
        if len(instances) >= count:
            break
        instance = build(scan, at_place(scan, kind, place), rules, seed)
        instances += [instance] if instance is not None else []
    if len(instances) < count:
        raise InputError(
            field="instances.count", expected=f"≤ {len(instances)}, all there are", received=count
        )
    return instances[:count]


def pick(scan: Scan, picked: PickedInstance, rules: InstanceRules, seed: int) -> AttackInstance:
    """The instance named in an experiment file; InputError where it breaks a rule."""
    scan.graph.row(picked.viewpoint)
    if picked.target is not None:
        scan.graph.row(picked.target)
    place = _place(scan, picked)
    attempt = at_place(scan, picked.kind, place, picked.target)
    instance = build(scan, attempt, rules, seed) if attackable(place, rules) else None
    if instance is None:
        raise InputError(
            file=scan.graph.scan,
            field=f"instance {picked.object} at {picked.viewpoint}",
            expected=f"category, coverage and episodes within the rules ({rules})",
            received=f"a {place.category}, coverage {place.coverage:.2f}, or too few episodes",
        )
    return instance


def at_place(scan: Scan, kind: Kind, place: Place, target: str | None = None) -> Attempt:
    """An attack on all val_seen episodes through a place."""
    name = f"{scan.graph.scan}-{place.object_id}-{place.viewpoint[:8]}-{kind}"
    test = [episode for episode in scan.val_seen if place.viewpoint in episode.path]
    return Attempt(name, kind, place, test, target)


def _place(scan: Scan, picked: PickedInstance) -> Place:
    for place in scan.places:
        if (place.object_id, place.viewpoint) == (picked.object, picked.viewpoint):
            return place
    raise InputError(
        file=scan.graph.scan,
        field="object",
        expected=f"one of {', '.join(sorted({p.object_id for p in scan.places}))}",
        received=picked.object,
    )
