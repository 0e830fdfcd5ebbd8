"""Words and phrases in which people give directions, in the manner of Room-to-Room."""

import re
from collections.abc import Mapping

import numpy as np

from vlnhijack.scenes.house import HouseObject

_OBJECTS = {
    "chair": ("chair", "seat", "armchair"),
    "cabinet": ("cabinet", "cupboard", "sideboard"),
    "table": ("table",),
    "plant": ("plant", "potted plant", "houseplant"),
    "sofa": ("sofa", "couch", "settee"),
    "tv_monitor": ("tv", "television", "screen"),
    "bed": ("bed", "mattress"),
    "lamp": ("lamp", "floor lamp", "standing lamp"),
    "table_lamp": ("table lamp", "desk lamp"),
    "shelf": ("shelf", "bookshelf", "bookcase"),
    "rug": ("rug", "carpet", "mat"),
    "picture": ("picture", "painting", "artwork"),
    "mirror": ("mirror", "looking glass"),
    "curtain": ("curtain", "curtains", "drapes"),
    "fireplace": ("fireplace", "hearth"),
    "desk": ("desk", "writing desk"),
    "nightstand": ("nightstand", "bedside table"),
    "coat_stand": ("coat stand", "coat rack"),
    "piano": ("piano",),
    "stool": ("stool", "footstool"),
    "bench": ("bench",),
    "fridge": ("fridge", "refrigerator"),
    "stove": ("stove", "oven", "cooker"),
    "counter": ("counter", "countertop", "worktop"),
    "sink": ("sink",),
    "washbasin": ("washbasin", "basin"),
    "toilet": ("toilet",),
    "bathtub": ("bathtub", "tub", "bath"),
    "washing_machine": ("washing machine", "washer"),
}
_ROOMS = {
    "bedroom": ("bedroom",),
    "kitchen": ("kitchen", "kitchen area", "cooking area"),
    "living room": ("living room", "lounge", "sitting room", "family room"),
    "dining room": ("dining room", "dining area"),
    "bathroom": ("bathroom", "washroom", "restroom"),
    "hallway": ("hallway", "hall", "corridor"),
    "office": ("office", "study", "home office"),
}
OBJECT_WORDS = {word: category for category, words in _OBJECTS.items() for word in words}
ROOM_WORDS = {word: label for label, words in _ROOMS.items() for word in words}

GRAMMAR: Mapping[str, tuple[str, ...]] = {
    # clauses, by the kind of fact; {o} and {p} are objects, {r} and {s} rooms
    "around": ("turn around", "turn all the way around", "make a u turn", "face the other way"),
    "turn": ("turn {side}", "turn {side}", "take a {side}", "make a {side}", "go {side}",
             "take a {side} turn", "turn to the {side}", "turn to your {side}", "veer {side}",
             "bear {side}", "hang a {side}"),
    "turn_at": ("turn {side} {at} the {o}", "take a {side} {at} the {o}", "go {side} {at} the {o}",
                "{at} the {o}, turn {side}", "when you see the {o} close by, turn {side}"),
    "straight": ("go straight", "{walk} straight {on}", "keep going straight", "{walk} forward",
                 "keep {walking}", "continue {on}"),
    "away": ("{walk} away from the {o}", "with the {o} behind you, {walk} {on}",
             "put the {o} behind you and {walk} {on}", "with your back to the {o}, {walk} forward",
             "start from the {o} and {walk} {on}"),
    "leave": ("leave the {r}", "exit the {r}", "{walk} out of the {r}", "leave this room",
              "exit the room", "come out of the {r}", "get out of the {r}"),
    "door": ("{walk} through the {opening}", "go out the {opening}", "pass through the {opening}",
             "{walk} into the next room", "use the {opening}"),
    "leave_enter": ("leave the {r} and {walk} into the {s}", "{walk} from the {r} into the {s}",
                    "exit the {r} {into} the {s}", "{walk} out of the {r} and enter the {s}",
                    "leave the {r} for the {s}"),
    "enter": ("enter the {r}", "{walk} into the {r}", "{walk} {into} the {r}", "go in the {r}",
              "{walk} to the {r}", "step into the {r}", "make your way to the {r}"),
    "cross": ("{walk} through the {r}", "cross the {r}", "{walk} across the {r}",
              "go all the way through the {r}"),
    "pass": ("{walk} past the {o}", "pass the {o}", "{walk} by the {o}", "pass by the {o}",
             "{walk} along the {o}", "{walk} past the {o}", "move on past the {o}"),
    "pass_side": ("{walk} past the {o} on {your} {side}", "pass the {o} on {your} {side}",
                  "keep the {o} on {your} {side}", "keep the {o} to {your} {side}",
                  "{walk} with the {o} on {your} {side}", "pass to the {other} of the {o}"),
    "between": ("{walk} between the {o} and the {p}", "pass between the {o} and the {p}",
                "{walk} through the gap between the {o} and the {p}"),
    "toward": ("{walk} {to} the {o}", "{walk} to the {o}", "head for the {o}",
               "{walk} straight until you {reach} the {o}", "approach the {o}",
               "{walk} until you {reach} the {o}", "{walk} up to the {o}", "make for the {o}"),
    # the same facts as the condition of the clause that follows
    "after_pass": ("after the {o}", "once you pass the {o}", "after you pass the {o}",
                   "after passing the {o}", "just past the {o}", "once past the {o}"),
    "after_toward": ("when you {reach} the {o}", "once you {reach} the {o}", "at the {o}",
                     "once you are at the {o}", "as you {reach} the {o}"),
    "after_enter": ("once you are in the {r}", "once inside the {r}", "in the {r}",
                    "after entering the {r}", "when you {reach} the {r}"),
    "after_leave": ("once you leave the {r}", "after leaving the {r}", "outside the {r}",
                    "once out of the {r}", "coming out of the {r}"),
    # where to stop
    "stop": ("{halt} {near} the {o}", "{halt} {near} the {o}", "{halt} {near} the {o}",
             "{halt} when you {reach} the {o}", "{halt} once you {reach} the {o}",
             "{halt} as soon as you are {near} the {o}", "{halt} right {near} the {o}",
             "the {o} is where you should {halt}", "your goal is {near} the {o}",
             "{halt} {near} the {o}, that is your destination"),
    "stop_pair": ("{halt} {near} the {o} {beside} the {p}", "{halt} {near} the {o} and the {p}",
                  "{halt} {near} the {o} that is {beside} the {p}",
                  "{halt} {near} the {p} and the {o}"),
    "stop_room": ("{halt} {near} the {o} in the {r}", "{halt} in the {r} {near} the {o}",
                  "{halt} once you are in the {r} {near} the {o}",
                  "in the {r}, {halt} {near} the {o}", "{halt} inside the {r} {near} the {o}"),
    "stop_there": ("{walk} {to} the {o} and {halt} there", "{walk} to the {o} and {halt}",
                   "{walk} over to the {o} and {halt} there", "find the {o} and {halt} there",
                   "approach the {o} and {halt}", "{walk} until you {reach} the {o} and {halt}"),
    "stop_end": ("{halt} in the {r}", "{halt} once you are in the {r}", "{halt} at the end",
                 "{halt} there", "that is where you {halt}"),
    # words
    "walk": ("walk", "walk", "walk", "go", "go", "go", "head", "move", "continue", "proceed",
             "carry on", "keep going", "stroll"),
    "walking": ("going", "walking", "moving"),
    "on": ("ahead", "on", "forward"),
    "your": ("your", "your", "the"),
    "at": ("at", "at", "by", "near", "next to"),
    "into": ("into", "through the {opening} into", "through the {opening} to"),
    "opening": ("doorway", "door", "doorway", "opening", "door frame"),
    "to": ("toward", "towards", "in the direction of"),
    "reach": ("reach", "get to", "come to", "arrive at"),
    "halt": ("stop", "stop", "stop", "stop", "wait", "wait", "stand", "pause", "halt", "stay",
             "end", "finish"),
    "near": ("by", "near", "next to", "in front of", "beside", "close to", "at"),
    "beside": ("next to", "beside", "near", "by"),
    "then": ("then", "next,", "now", "after that,", "from there"),
}  # fmt: skip


def word_groups() -> tuple[dict[str, str], dict[str, str]]:
    """Object words and room words, each mapped to its category or label.

    Some words are parts of others ("lamp", "table lamp"): look for the longest first.
    """
    return dict(OBJECT_WORDS), dict(ROOM_WORDS)


def object_word(thing: HouseObject, rng: np.random.Generator) -> str:
    """A word for an object, the plain one half of the time, seldom with a true adjective."""
    word = _word(_OBJECTS.get(thing.category, (thing.category.replace("_", " "),)), rng)
    return f"{_adjective(thing.size, rng)} {word}" if rng.random() < 0.12 else word


def room_word(label: str, rng: np.random.Generator) -> str:
    """A word for a room; the plain one half of the time."""
    return _word(_ROOMS.get(label, (label,)), rng)


def phrase(rule: str, slots: Mapping[str, str], rng: np.random.Generator) -> str:
    """A random expansion of a grammar rule with the slots filled in."""

    def expand(match: re.Match[str]) -> str:
        name = match[1]
        return slots[name] if name in slots else phrase(name, slots, rng)

    return re.sub(r"\{(\w+)\}", expand, GRAMMAR[rule][rng.integers(len(GRAMMAR[rule]))])


def _word(words: tuple[str, ...], rng: np.random.Generator) -> str:
    return words[0] if rng.random() < 0.5 else words[rng.integers(len(words))]


def _adjective(size: tuple[float, float, float], rng: np.random.Generator) -> str:
    if size[2] > 1.4:
        return "tall"
    if max(size) > 1.4:
        return _word(("large", "big", "long", "wide"), rng)
    return _word(("small", "little"), rng) if max(size) < 0.7 else "nearby"
