"""Material libraries of Wavefront OBJ files."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from vlnhijack.errors import InputError

Colour = tuple[float, float, float]

_ARGUMENTS = {"-o": 3, "-s": 3, "-t": 3, "-mm": 2}  # other options of a map have one


@dataclass(frozen=True)
class MtlMaterial:
    """A material: Kd in [0,1], the file of map_Kd or None, and whether the map is clamped."""

    colour: Colour = (1.0, 1.0, 1.0)
    image: Path | None = None
    clamped: bool = False


@dataclass
class _Draft:
    colour: Colour = (1.0, 1.0, 1.0)
    words: list[str] = field(default_factory=list)


def material_libraries(file: Path) -> list[Path]:
    """The libraries that an OBJ file names before its first face."""
    found = []
    with file.open(errors="replace") as lines:
        for line in lines:
            if line.startswith("mtllib"):
                found.append(file.parent / line[len("mtllib") :].strip())
            elif line.startswith("f "):
                break
    return found


def read_mtl(file: Path) -> dict[str, MtlMaterial]:
    """Materials by name; InputError where the file is missing or Kd is not three numbers."""
    try:
        text = file.read_text(errors="replace")
    except OSError as error:
        expected = "a material library (or --allow-missing)"
        raise InputError(file=file, expected=expected, received=error.strerror) from None
    return {name: _finished(file, draft) for name, draft in _drafts(file, text)}


def _drafts(file: Path, text: str) -> Iterator[tuple[str, _Draft]]:
    name, draft = None, _Draft()
    for line in text.splitlines():
        key, *words = line.split() or [""]
        if key == "newmtl":
            if name is not None:
                yield name, draft
            name, draft = " ".join(words), _Draft()
        elif key.lower() == "kd":
            draft.colour = _colour(file, name, words)
        elif key.lower() == "map_kd":
            draft.words = words
    if name is not None:
        yield name, draft


def _colour(file: Path, name: str | None, words: list[str]) -> Colour:
    try:
        red, green, blue = (min(max(float(word), 0.0), 1.0) for word in words)
    except ValueError:
        raise InputError(
            file=file, field=f"{name}: Kd", expected="three numbers", received=" ".join(words)
        ) from None
    return red, green, blue


def _finished(file: Path, draft: _Draft) -> MtlMaterial:
    words, clamped = list(draft.words), False
    while words and words[0] in {*_ARGUMENTS, "-clamp", "-blendu", "-blendv", "-bm", "-texres"}:
        option = words.pop(0)
        clamped |= option == "-clamp" and words[:1] == ["on"]
        del words[: _ARGUMENTS.get(option, 1)]
    image = file.parent / " ".join(words).replace("\\", "/") if words else None
    return MtlMaterial(draft.colour, image, clamped)
