"""The paper's attack instances: the instructions of a val_seen path share one attack."""

from collections.abc import Iterator, Sequence

from vlnhijack import seeds
from vlnhijack.experiments.config import DatasetInstances
from vlnhijack.experiments.instances.rules import (
    Attempt,
    Place,
    Scan,
    attackable,
    build,
    support,
    supported,
)
from vlnhijack.navigation.episode import Episode
from vlnhijack.threat import AttackInstance


def construct(scans: Sequence[Scan], settings: DatasetInstances) -> list[AttackInstance]:
    """The instances of all scans, in the order of their val_seen paths (paper, section 3.2).

    The attack viewpoint of a path is the one whose object fills a view most, among those with
    enough support; single-step sets leave out the episodes that end there afterwards.
    """
    instances: list[AttackInstance] = []
    for scan in scans:
        for path in _paths(scan.val_seen):
            place = attack_place(scan, path, settings)
            if place is not None:
                instances += _attacks(scan, path, place, settings)
    return _capped(instances, settings)


def attack_place(scan: Scan, path: Sequence[Episode], settings: DatasetInstances) -> Place | None:
    """The place that the episodes of one path are attacked at, None where the path has none.

    Ties go to the viewpoint that comes first, then to the object that comes first.
    """
    rules = settings.rules
    best: Place | None = None
    for viewpoint in _allowed(path[0].path, settings):
        places = [p for p in scan.places_at.get(viewpoint, ()) if attackable(p, rules)]
        if not places or not supported(support(scan, viewpoint, path), rules):
            continue
        largest = max(places, key=lambda place: place.coverage)
        if best is None or largest.coverage > best.coverage:
            best = largest
    return best


def _allowed(path: Sequence[str], settings: DatasetInstances) -> list[str]:
    left_out = {path[0]} if not settings.first_viewpoint else set()
    left_out |= {path[-1]} if not settings.last_viewpoint else set()
    return [viewpoint for viewpoint in dict.fromkeys(path) if viewpoint not in left_out]


def _attacks(
    scan: Scan, path: Sequence[Episode], place: Place, settings: DatasetInstances
) -> Iterator[AttackInstance]:
    if settings.per_instruction:
        groups = {episode.instruction_id: [episode] for episode in path}
    else:
        groups = {str(path[0].path_id): list(path)}
    for name, test in groups.items():
        attempt_id = f"{scan.graph.scan}-{name}-{settings.kind}"
        attempt = Attempt(attempt_id, settings.kind, place, test)
        instance = build(scan, attempt, settings.rules, settings.seed)
        if instance is not None:
            yield instance


def _paths(episodes: Sequence[Episode]) -> list[list[Episode]]:
    paths: dict[int, list[Episode]] = {}
    for episode in episodes:
        paths.setdefault(episode.path_id, []).append(episode)
    return list(paths.values())


def _capped(instances: list[AttackInstance], settings: DatasetInstances) -> list[AttackInstance]:
    objects = sorted({(instance.scan, instance.object_id) for instance in instances})
    order = seeds.stream(settings.seed, "objects").permutation(len(objects))
    kept = {objects[row] for row in order[: settings.max_objects]}
    return [each for each in instances if (each.scan, each.object_id) in kept]
