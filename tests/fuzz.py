"""Broken input for readers: a valid JSON value with something wrong in it, or no JSON at all."""

import copy
import gzip
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from hypothesis import strategies as st

from vlnhijack.errors import InputError

SCALARS = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.sampled_from([10**400, -1, 2**63, float("nan"), float("inf"), "", " ", "\ud800", "é"])
    | st.floats()
    | st.text(max_size=8)
)
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner),
    max_leaves=6,
)


@st.composite
def broken(draw: st.DrawFn, valid: Any) -> Any:
    """The valid value where, at one to three places, a part is replaced, removed or repeated."""
    value = copy.deepcopy(valid)
    for _ in range(draw(st.integers(1, 3))):
        holder = [value]
        place: Any = holder
        key: Any = 0
        while isinstance(place[key], dict | list) and place[key] and draw(st.integers(0, 4)):
            place = place[key]
            names = range(len(place)) if isinstance(place, list) else sorted(place)
            key = draw(st.sampled_from(list(names)))
        what = draw(st.sampled_from(["replace", "remove", "repeat"]))
        if what == "remove" and place is not holder:
            del place[key]
        elif what == "repeat" and isinstance(place, list) and place is not holder:
            place.append(copy.deepcopy(place[key]))
        else:
            place[key] = draw(VALUES)
        value = holder[0]
    return value


def texts(valid: Any, *, lines: bool = False) -> st.SearchStrategy[bytes]:
    """Contents of a file: broken values as JSON (or JSON lines), cut off, or arbitrary bytes."""

    def write(value: Any) -> bytes:
        if lines and isinstance(value, list):
            return "\n".join(json.dumps(each) for each in value).encode()
        return json.dumps(value).encode()

    whole = broken(valid).map(write)
    cut = st.tuples(whole, st.integers(0, 400)).map(lambda pair: pair[0][: pair[1]])
    return whole | cut | st.binary(max_size=40) | st.just(b"[" * 100_000)


def refused_or_read(file: Path, content: bytes, read: Callable[[Path], Any]) -> None:
    """Reading the content, plain or gzipped, ends well or with an InputError of one line."""
    file.write_bytes(gzip.compress(content) if file.suffix == ".gz" else content)
    try:
        read(file)
    except InputError as error:
        assert str(file.parent) in str(error), "the file is named"
        assert "\n" not in str(error)
