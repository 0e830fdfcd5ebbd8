"""English instructions for a walk: true, varied, and under-specified as people's are."""

from collections.abc import Sequence
from itertools import groupby

import numpy as np

from vlnhijack.scenes.procedural.facts import Fact, stop_facts, walk_facts
from vlnhijack.scenes.procedural.landmarks import Landmarks
from vlnhijack.scenes.procedural.phrases import GRAMMAR, object_word, phrase, room_word

MOST_WORDS, FEWEST_WORDS, MOST_CLAUSES = 35, 8, 4
KEPT = {
    "around": 0.5, "turn": 0.65, "straight": 0.25, "away": 0.3, "leave": 0.6, "enter": 0.65,
    "cross": 0.4, "door": 0.2, "pass": 0.6, "between": 0.5, "toward": 0.6,
}  # fmt: skip
OTHER_SIDE = {"left": "right", "right": "left", "": ""}


def write_instructions(
    landmarks: Landmarks, path: Sequence[str], heading: float, rng: np.random.Generator, count: int
) -> list[str]:
    """`count` different instructions for a walk, each from facts chosen independently."""
    found: list[str] = []
    while len(found) < count:
        text, _ = write_instruction(landmarks, path, heading, rng)
        if text not in found:
            found.append(text)
    return found


def write_instruction(
    landmarks: Landmarks, path: Sequence[str], heading: float, rng: np.random.Generator
) -> tuple[str, list[Fact]]:
    """One instruction of 8 to 35 words and the facts that it tells, in their order."""
    known, goals = walk_facts(landmarks, path, heading), stop_facts(landmarks, path)
    while True:
        told = _choose(known, rng)
        stop = _choose_stop(goals, landmarks.rooms[path[-1]].label, float(len(path) - 1), rng)
        told = [fact for fact in told if not set(fact.objects) & set(stop.objects)]
        text = _join(_clauses(landmarks, told, rng), _stop_clause(landmarks, path, stop, rng), rng)
        if FEWEST_WORDS <= len(text.split()) <= MOST_WORDS:
            return text, [*told, stop]


def _choose(known: list[Fact], rng: np.random.Generator) -> list[Fact]:
    """The facts to tell: some of the many, no object twice, one passed object an edge."""
    kept = [fact for fact in _thin(known, rng) if rng.random() < KEPT[fact.kind]]
    while len(kept) > MOST_CLAUSES:
        kept.pop(rng.integers(len(kept)))
    told: list[Fact] = []
    for fact in kept:
        repeats = told and fact.kind == told[-1].kind in ("straight", "door", "around", "turn")
        same_room = any(fact.room and fact.room == other.room for other in told)
        same_object = any(set(fact.objects) & set(other.objects) for other in told)
        if not (repeats or same_room or same_object):
            told.append(fact)
    return told


def _thin(known: list[Fact], rng: np.random.Generator) -> list[Fact]:
    """At most one landmark of a kind at a step, drawn by weight."""
    thinned: list[Fact] = []
    for _, group in groupby(sorted(known, key=_step_and_kind), key=_step_and_kind):
        facts = list(group)
        weights = np.array([fact.weight for fact in facts])
        thinned.append(facts[rng.choice(len(facts), p=weights / weights.sum())])
    return sorted(thinned, key=lambda fact: fact.at)


def _step_and_kind(fact: Fact) -> tuple[int, str]:
    return int(fact.at), "pass" if fact.kind == "between" else fact.kind


def _choose_stop(goals: list[Fact], room: str, at: float, rng: np.random.Generator) -> Fact:
    """A landmark to stop at, mostly the one that tells the goal best; seldom the room alone."""
    if not goals or rng.random() < 0.04:
        return Fact("stop", at, room=room)
    logits = np.array([fact.weight / 0.6 - (len(fact.objects) == 2) for fact in goals])
    weights = np.exp(logits - logits.max())
    return goals[rng.choice(len(goals), p=weights / weights.sum())]


def _clauses(
    landmarks: Landmarks, told: list[Fact], rng: np.random.Generator
) -> list[tuple[str, bool]]:
    """Clauses in order; True marks one that is the condition of the next."""
    clauses: list[tuple[str, bool]] = []
    rest = list(told)
    while rest:
        fact = rest.pop(0)
        slots = _slots(landmarks, fact, rng)
        rule: str = fact.kind
        if fact.kind == "leave" and rest and rest[0].kind == "enter" and rest[0].at - fact.at < 0.1:
            slots["s"] = room_word(rest.pop(0).room, rng)
            rule = "leave_enter"
        elif fact.kind == "turn" and fact.objects and rng.random() < 0.6:
            rule = "turn_at"
        elif fact.kind == "pass" and rng.random() < 0.4:
            rule = "pass_side"
        after = clauses[-1][1] if clauses else False
        may_wait = f"after_{fact.kind}" in GRAMMAR and rule != "leave_enter" and not after
        if may_wait and rng.random() < 0.25:
            clauses.append((phrase(f"after_{fact.kind}", slots, rng), True))
        else:
            clauses.append((phrase(rule, slots, rng), False))
    return clauses


def _slots(landmarks: Landmarks, fact: Fact, rng: np.random.Generator) -> dict[str, str]:
    words = (object_word(landmarks.house.object(name), rng) for name in fact.objects)
    slots = dict(zip("op", words, strict=False))
    sides = {"side": fact.side, "other": OTHER_SIDE[fact.side]}
    return slots | sides | ({"r": room_word(fact.room, rng)} if fact.room else {})


def _stop_clause(
    landmarks: Landmarks, path: Sequence[str], stop: Fact, rng: np.random.Generator
) -> str:
    slots = _slots(landmarks, stop, rng)
    if not stop.objects:
        return phrase("stop_end", slots, rng)
    if len(stop.objects) == 2:
        return phrase("stop_pair", slots, rng)
    draw = rng.random()
    if draw < 0.45 and stop.room:
        return phrase("stop_room", slots, rng)
    there, before = (landmarks.sightings[v].get(stop.objects[0]) for v in (path[-1], path[-2]))
    if draw < 0.62 and there and before and there.distance < before.distance:
        return phrase("stop_there", slots, rng)
    return phrase("stop", slots, rng)


def _join(clauses: list[tuple[str, bool]], stop: str, rng: np.random.Generator) -> str:
    """Sentences of one to three clauses."""
    text, length, pending = "", 0, False
    for clause, condition in [*clauses, (stop, False)]:
        if not text:
            text = clause
        elif pending:
            text += f", {clause}"
        else:
            link = rng.choice([". ", " and ", ", then ", ", "], p=[0.4, 0.35, 0.15, 0.1])
            link = ". " if length >= 3 or (condition and link == ", ") else link
            opener = f"{phrase('then', {}, rng)} " if link == ". " and rng.random() < 0.2 else ""
            text += link + opener + clause
            length = 0 if link == ". " else length
        length, pending = length + 1, condition
    return ". ".join(part[0].upper() + part[1:] for part in text.split(". ")) + "."
