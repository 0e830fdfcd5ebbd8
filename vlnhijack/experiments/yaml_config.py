"""YAML files checked against pydantic models: unknown keys and wrong types are errors."""

from collections.abc import Sequence
from math import isqrt
from pathlib import Path
from typing import Annotated, Any, TypeVar

import yaml
from pydantic import AfterValidator, BaseModel, ConfigDict, PositiveInt, ValidationError
from pydantic_core import PydanticCustomError

from vlnhijack.artifacts import write_text
from vlnhijack.errors import InputError


def _square(value: int) -> int:
    if isqrt(value) ** 2 != value:
        raise PydanticCustomError("square", "a square number")
    return value


SquareInt = Annotated[PositiveInt, AfterValidator(_square)]


class Settings(BaseModel):
    """A frozen group of settings; keys that are not its own and infinities are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


Config = TypeVar("Config", bound=Settings)


def load_config(file: Path | None, model: type[Config], overrides: Sequence[str] = ()) -> Config:
    """Read `file` (None: all defaults), apply `key.sub=value` overrides (YAML), and validate.

    Raises InputError that names file, key, expected and received.
    """
    values = {} if file is None else _read(file)
    for override in overrides:
        _override(values, override)
    try:
        return model.model_validate(values)
    except ValidationError as error:
        raise _deepest_error(file, values, error) from None


def save_config(path: Path, config: Settings) -> None:
    """Write the resolved settings, defaults included."""
    write_text(path, yaml.safe_dump(config.model_dump(mode="json"), sort_keys=False))


def _read(file: Path) -> dict[str, Any]:
    try:
        values = yaml.safe_load(file.read_text())
    except FileNotFoundError:
        raise InputError(file=file, expected="a YAML file", received="no such file") from None
    except (UnicodeDecodeError, yaml.YAMLError) as error:
        raise InputError(f"not valid YAML ({error})", file=file) from None
    if not isinstance(values, dict):
        raise InputError(file=file, expected="keys and values", received=type(values).__name__)
    return values


def _override(values: dict[str, Any], override: str) -> None:
    key, equals, text = override.partition("=")
    if not equals or not key:
        raise InputError(field="--set", expected="key=value", received=override)
    *parents, last = key.split(".")
    place: Any = values
    for parent in parents:
        place = place.setdefault(parent, {}) if isinstance(place, dict) else None
    if not isinstance(place, dict):
        raise InputError(field="--set", expected="keys of nested settings", received=key)
    try:
        place[last] = yaml.safe_load(text)
    except yaml.YAMLError:
        raise InputError(field=f"--set {key}", expected="a YAML value", received=text) from None


def _deepest_error(file: Path | None, values: dict[str, Any], error: ValidationError) -> InputError:
    """Of the alternatives of a union, the one that fits furthest is the one that was meant."""
    found = max(error.errors(), key=lambda each: len(each["loc"]))
    expected, received = found["msg"].removeprefix("Input should be "), found["input"]
    if found["type"] in ("extra_forbidden", "unexpected_keyword_argument"):
        expected = "no such key"
    if found["type"] == "missing":
        expected, received = "a value", "nothing"
    absent = [str(found["loc"][-1])] if found["type"] == "missing" else []
    field = ".".join(_keys(values, found["loc"]) + absent)
    if found["type"] == "value_error":
        return InputError(str(found["ctx"]["error"]), file=file, field=field or None)
    return InputError(file=file, field=field, expected=expected, received=received)


def _keys(values: Any, location: Sequence[str | int]) -> list[str]:
    """The keys of a location that are there, without the names of the alternatives of a union."""
    keys = []
    for part in location:
        if isinstance(part, int) or (isinstance(values, dict) and part in values):
            keys.append(str(part))
            values = values[part]
    return keys
