"""What an instruction says is true of the geometry, computed here without the generator's help."""

import re
from collections import Counter
from itertools import pairwise

import numpy as np
import pytest

from tests.box_house import blocked, box_house, objects, walls
from vlnhijack import seeds
from vlnhijack.scenes.procedural.facts import Fact, stop_facts, walk_facts
from vlnhijack.scenes.procedural.instructions import write_instruction, write_instructions
from vlnhijack.scenes.procedural.landmarks import find_landmarks
from vlnhijack.scenes.procedural.phrases import GRAMMAR, OBJECT_WORDS, ROOM_WORDS, phrase

HOUSE = box_house()
GRAPH = HOUSE.graph
LANDMARKS = find_landmarks(HOUSE)
BOXES = {name: box for name, (_, _, box) in objects().items()}
CATEGORY = {name: category for name, (category, _, _) in objects().items()}
PAIRS = [(a, b) for a in GRAPH.viewpoints[::3] for b in GRAPH.viewpoints[::4]]
PATHS = [tuple(GRAPH.shortest_path(a, b)) for a, b in PAIRS if GRAPH.distance(a, b) > 5]
NAMED = re.compile(r"\b(" + "|".join(sorted(OBJECT_WORDS, key=len, reverse=True)) + r")\b")
ROOMS = re.compile(r"\b(" + "|".join(sorted(ROOM_WORDS, key=len, reverse=True)) + r")\b")


def place(viewpoint: str) -> np.ndarray:
    return GRAPH.positions[GRAPH.row(viewpoint)]


def bearing(start: str, end: str, name: str, eye: str) -> float:
    """Degrees, clockwise, from the walk start → end to the middle of an object seen from eye."""
    x0, y0, x1, y1, _ = BOXES[name]
    way, look = place(end) - place(start), np.array([(x0 + x1) / 2, (y0 + y1) / 2]) - place(eye)[:2]
    angle = np.arctan2(look[0], look[1]) - np.arctan2(way[0], way[1])
    return float(np.degrees((angle + np.pi) % (2 * np.pi) - np.pi))


def gap(viewpoint: str, name: str) -> float:
    x, y, _ = place(viewpoint)
    x0, y0, x1, y1, _ = BOXES[name]
    return float(np.hypot(max(x0 - x, 0, x - x1), max(y0 - y, 0, y - y1)))


def in_sight(viewpoint: str, name: str) -> bool:
    x0, y0, x1, y1, height = BOXES[name]
    hiding = [*walls(), *(box for other, box in BOXES.items() if other != name)]
    points = [
        np.array([x, y, z])
        for x in np.linspace(x0, x1, 4)
        for y in np.linspace(y0, y1, 4)
        for z in (0.01, height / 2, height)
    ]
    return any(not any(blocked(place(viewpoint), p, box) for box in hiding) for p in points)


def room(viewpoint: str) -> str:
    x, y, _ = place(viewpoint)
    return next(
        r.label
        for r in HOUSE.rooms
        if r.bounds[0] <= x <= r.bounds[2] and r.bounds[1] <= y <= r.bounds[3]
    )


def degrees_turned(path: tuple[str, ...], heading: float, step: int) -> float:
    ways = [place(b) - place(a) for a, b in pairwise(path)]
    headings = [heading, *(np.arctan2(w[0], w[1]) for w in ways)]
    turned = headings[step + 1] - headings[step]
    return float(np.degrees((turned + np.pi) % (2 * np.pi) - np.pi))


def check(fact: Fact, path: tuple[str, ...], heading: float) -> None:
    step = min(int(fact.at), len(path) - 2)
    start, end = path[step], path[step + 1]
    if fact.kind in ("turn", "around", "straight"):
        angle = degrees_turned(path, heading, step if fact.kind != "straight" else step + 1)
        if fact.kind == "turn":
            assert 39 < abs(angle) < 136 and (angle > 0) == (fact.side == "right")
            assert all(gap(start, name) < 2 and in_sight(start, name) for name in fact.objects)
        else:
            assert abs(angle) < 26 if fact.kind == "straight" else abs(angle) > 134
    elif fact.kind in ("pass", "between"):
        sides = []
        for name in fact.objects:
            assert abs(bearing(start, end, name, start)) < 90 < abs(bearing(start, end, name, end))
            assert in_sight(start, name) or in_sight(end, name)
            sides.append("right" if bearing(start, end, name, start) > 0 else "left")
        assert sides == [fact.side] if fact.kind == "pass" else set(sides) == {"left", "right"}
    elif fact.kind == "toward":
        (name,) = fact.objects
        assert gap(end, name) < 2 and gap(end, name) < gap(start, name)
        assert in_sight(start, name) and in_sight(end, name)
    elif fact.kind == "away":
        assert abs(bearing(start, end, fact.objects[0], start)) > 134
    elif fact.kind in ("leave", "enter", "cross", "door"):
        assert room(start) != room(end)
        assert fact.room in {
            "leave": {room(start)},
            "enter": {room(end)},
            "cross": {room(start)},
        }.get(fact.kind, {""})
    else:
        goal = path[-1]
        assert fact.kind == "stop" and fact.room in ("", room(goal))
        assert all(gap(goal, name) < 3 and in_sight(goal, name) for name in fact.objects[:1])
        assert all(in_sight(goal, name) for name in fact.objects)


@pytest.mark.parametrize("heading", [0.0, 2.1])
def test_every_fact_of_a_walk_is_true(heading: float) -> None:
    kinds = Counter()
    for path in PATHS:
        for fact in [*walk_facts(LANDMARKS, path, heading), *stop_facts(LANDMARKS, path)]:
            check(fact, path, heading)
            kinds[fact.kind] += 1
    assert set(kinds) == {
        "around", "turn", "straight", "away", "leave", "enter", "cross", "door", "pass",
        "between", "toward", "stop",
    }  # fmt: skip


def test_an_instruction_tells_its_facts_and_nothing_else() -> None:
    rng = seeds.stream(0, "tells")
    for path in PATHS:
        text, told = write_instruction(LANDMARKS, path, 1.0, rng)
        lower = text.lower()
        objects_told = Counter(CATEGORY[name] for fact in told for name in fact.objects)
        objects_said = Counter(OBJECT_WORDS[word] for word in NAMED.findall(lower))
        assert objects_said <= objects_told, text
        assert objects_said[CATEGORY[name]] if (name := next(iter(told[-1].objects), "")) else True
        rooms_said = {ROOM_WORDS[word] for word in ROOMS.findall(lower)}
        assert rooms_said <= {fact.room for fact in told}, text
        assert told[:-1] == sorted(told[:-1], key=lambda fact: fact.at)
        if not {"turn", "pass"} & {fact.kind for fact in told}:
            assert not re.search(r"\b(left|right) (side|hand)|turn (left|right)", lower), text


@pytest.mark.parametrize("side", ["left", "right"])
def test_sides_in_phrases(side: str) -> None:
    rng, other = seeds.stream(0, "sides"), {"left": "right", "right": "left"}[side]
    slots = {"side": side, "other": other, "o": "sofa"}
    for _ in range(50):
        said = phrase("pass_side", slots, rng)
        wrong = rf"(on|to) (your|the) {other}\b(?! of)|the {side} of"
        assert not re.search(wrong, said), said
        assert other not in phrase("turn", slots, rng)


def test_instructions_are_short_varied_and_end_at_a_landmark() -> None:
    rng = seeds.stream(0, "varied")
    found, landmarks, words = set(), 0, Counter()
    for path in PATHS:
        texts = write_instructions(LANDMARKS, path, 0.5, rng, 3)
        assert len(set(texts)) == 3
        for text in texts:
            assert 8 <= len(text.split()) <= 35 and text[0].isupper() and text.endswith(".")
            assert not re.search(r"[{}_\d]|  |\bmet(er|re)s?\b", text), text
            landmarks += bool(NAMED.search(text.lower().rsplit(".", 2)[-2]))
        found.update(texts)
        words.update(re.findall(r"[a-z]+", " ".join(texts).lower()))
    assert len(found) > 0.95 * 3 * len(PATHS)
    assert landmarks > 0.85 * 3 * len(PATHS)
    assert len(words) > 130


def test_turns_are_rarely_told() -> None:
    rng, known, told = seeds.stream(0, "turns"), 0, 0
    for path in PATHS * 2:
        known += sum(fact.kind == "turn" for fact in walk_facts(LANDMARKS, path, 0.0))
        _, facts = write_instruction(LANDMARKS, path, 0.0, rng)
        told += sum(fact.kind == "turn" for fact in facts)
    assert told < 0.45 * known


def test_the_same_stream_writes_the_same_text() -> None:
    texts = [
        write_instructions(LANDMARKS, PATHS[0], 0.0, seeds.stream(3, "again"), 3) for _ in range(2)
    ]
    assert texts[0] == texts[1]


def test_every_rule_expands() -> None:
    slots = dict.fromkeys(("o", "p", "r", "s", "side", "other"), "x")
    for rule, options in GRAMMAR.items():
        for seed in range(3 * len(options)):
            assert "{" not in phrase(rule, slots, np.random.default_rng(seed))
