"""What is true of a walk through a house: turns, rooms, objects passed and reached, the goal."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import Literal

import numpy as np

from vlnhijack.frames import direction, heading_of, wrap
from vlnhijack.scenes.procedural.landmarks import Landmarks, Sighting, box_distance

Kind = Literal[
    "around", "turn", "straight", "away", "leave", "enter", "cross", "door", "pass", "between",
    "toward", "stop",
]  # fmt: skip
TURN, AROUND, STRAIGHT = np.radians(40), np.radians(135), np.radians(25)
BESIDE = 1.8  # an object passed is at most this far from the way, metres
REACHED = 1.8
AT_GOAL = 2.6  # a stop landmark is at most this far from the goal
NEXT_TO = 0.9


@dataclass(frozen=True)
class Fact:
    """One thing that is true of a walk.

    at: when, in viewpoints of the path and parts of an edge; objects: ids; room: label;
    side: "left" or "right" of the walking direction; weight: how well it tells the way.
    """

    kind: Kind
    at: float
    objects: tuple[str, ...] = ()
    room: str = ""
    side: str = ""
    weight: float = 1.0


def walk_facts(landmarks: Landmarks, path: Sequence[str], heading: float) -> list[Fact]:
    """Facts of a walk along `path` that starts looking along `heading`, in the order of time."""
    points = [landmarks.position(viewpoint) for viewpoint in path]
    headings = [float(heading_of(there - here)) for here, there in pairwise(points)]
    facts = [
        *_turns(landmarks, path, [heading, *headings]),
        *_behind(landmarks, path, headings[0]),
        *_rooms(landmarks, path),
        *_straights(headings),
    ]
    for step in range(len(headings)):
        facts += _passed(landmarks, path, step)
        facts += _reached(landmarks, path, step, headings)
    return sorted(facts, key=lambda fact: fact.at)


def stop_facts(landmarks: Landmarks, path: Sequence[str]) -> list[Fact]:
    """The landmarks of the goal, each weighted by how much nearer it is there than elsewhere.

    Objects of the goal's room come first; a room is named only with them. A second object is one
    that stands next to the first. Empty where the goal has no landmark.
    """
    goal, seen, room = path[-1], landmarks.sightings[path[-1]], landmarks.rooms[path[-1]]
    near = [s for s in seen.values() if s.distance <= AT_GOAL and s.salience >= 0.2]
    near = [s for s in near if s.distance == landmarks.nearest(goal, s.category)]
    inside = [s for s in near if landmarks.house.object(s.object_id).room == room.id]
    others = {*path[:-1], *landmarks.house.graph.neighbours(goal)}
    label, at = room.label if inside else "", float(len(path) - 1)
    facts = []
    for sighting in inside or near:
        weight = _contrast(landmarks, sighting, goal, others)
        facts.append(Fact("stop", at, (sighting.object_id,), label, weight=weight))
        facts += [
            Fact("stop", at, (sighting.object_id, other.object_id), label, weight=weight)
            for other in seen.values()
            if other.category != sighting.category
            and landmarks.gap(sighting.object_id, other.object_id) <= NEXT_TO
        ]
    return facts


def _contrast(landmarks: Landmarks, sighting: Sighting, goal: str, others: set[str]) -> float:
    """Mean of metres by which the category is nearer at the goal than at the other viewpoints."""
    elsewhere = [min(landmarks.nearest(v, sighting.category), 6.0) for v in sorted(others)]
    return float(np.mean(elsewhere) - sighting.distance)


def _turns(landmarks: Landmarks, path: Sequence[str], headings: list[float]) -> Iterator[Fact]:
    """Turns at every viewpoint, with the nearest object in reach, if any, as where to turn."""
    for step, (before, after) in enumerate(pairwise(headings)):
        angle = float(wrap(after - before))
        if abs(angle) < TURN:
            continue
        if abs(angle) > AROUND:
            yield Fact("around", step)
            continue
        reach = [s for s in landmarks.sightings[path[step]].values() if s.distance < REACHED]
        where = max(reach, key=lambda s: s.salience, default=None) if step else None
        objects = () if where is None else (where.object_id,)
        yield Fact("turn", step, objects, side="right" if angle > 0 else "left")


def _behind(landmarks: Landmarks, path: Sequence[str], heading: float) -> Iterator[Fact]:
    for sighting in landmarks.sightings[path[0]].values():
        behind = abs(wrap(sighting.heading - heading)) > AROUND
        if behind and sighting.distance < 2.5:
            yield Fact("away", 0.01, (sighting.object_id,), weight=sighting.salience)


def _rooms(landmarks: Landmarks, path: Sequence[str]) -> Iterator[Fact]:
    rooms = [landmarks.rooms[viewpoint] for viewpoint in path]
    changes = [step for step, (a, b) in enumerate(pairwise(rooms)) if a.id != b.id]
    for number, step in enumerate(changes):
        here, there = rooms[step].label, rooms[step + 1].label
        yield Fact("door", step + 0.5)
        if number == 0 and here not in {room.label for room in rooms[step + 1 :]}:
            yield Fact("leave", step + 0.49, room=here)
        if here != there:
            yield Fact("enter", step + 0.51, room=there)
        if number + 1 < len(changes) and here != there:
            yield Fact("cross", changes[number + 1] + 0.48, room=there)


def _straights(headings: list[float]) -> Iterator[Fact]:
    for step, (before, after) in enumerate(pairwise(headings)):
        if abs(wrap(after - before)) < STRAIGHT:
            yield Fact("straight", step + 0.02)


def _passed(landmarks: Landmarks, path: Sequence[str], step: int) -> Iterator[Fact]:
    """Objects beside an edge that are ahead where it starts and no longer ahead where it ends."""
    start, end = landmarks.position(path[step]), landmarks.position(path[step + 1])
    length = float(np.linalg.norm(end - start))
    along = (end - start) / length
    seen = landmarks.sightings[path[step]] | landmarks.sightings[path[step + 1]]
    rooms = {landmarks.rooms[viewpoint].id for viewpoint in path[step : step + 2]}
    facts = []
    for object_id, sighting in seen.items():
        if landmarks.house.object(object_id).room not in rooms:
            continue
        x, y = np.asarray(landmarks.house.object(object_id).centre[:2]) - start
        ahead = float(x * along[0] + y * along[1])
        right = float(x * along[1] - y * along[0])
        gap = box_distance(start + ahead * along, landmarks.footprints[object_id])
        if 0.2 < ahead < length - 0.1 and gap < BESIDE and abs(right) > 0.3:
            at, side = step + ahead / length, "right" if right > 0 else "left"
            facts.append(Fact("pass", at, (object_id,), side=side, weight=sighting.salience))
    yield from facts
    for one, other in combinations(facts, 2):
        kinds = {landmarks.category(fact.objects[0]) for fact in (one, other)}
        if one.side != other.side and len(kinds) == 2:
            weight = (one.weight + other.weight) / 2
            yield Fact("between", one.at, one.objects + other.objects, weight=weight)


def _reached(
    landmarks: Landmarks, path: Sequence[str], step: int, headings: list[float]
) -> Iterator[Fact]:
    """Objects ahead at the start of a straight run that the run ends at."""
    last = step
    while last + 1 < len(headings) and abs(wrap(headings[last + 1] - headings[step])) < STRAIGHT:
        last += 1
    end = landmarks.position(path[last + 1])
    course = direction(heading_of(end - landmarks.position(path[step])))[:2]
    for sighting in landmarks.sightings[path[step]].values():
        if sighting.object_id not in landmarks.sightings[path[last + 1]]:
            continue
        offset = np.asarray(landmarks.house.object(sighting.object_id).centre[:2]) - end
        left = box_distance(end, landmarks.footprints[sighting.object_id])
        ahead = abs(wrap(sighting.heading - headings[step])) < STRAIGHT
        if ahead and left < min(REACHED, 0.6 * sighting.distance) and offset @ course > 0:
            at, objects = last + 0.95, (sighting.object_id,)
            yield Fact("toward", at, objects, weight=sighting.salience)
