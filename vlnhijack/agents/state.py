"""Weights by name: put into a model, or refused with names and shapes."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

import torch
from torch import Tensor, nn

from vlnhijack.errors import InputError

_SHOWN = 10

State = Mapping[str, Tensor]
Model = TypeVar("Model", bound=nn.Module)


def fill(make: Callable[[], Model], state: State, path: Path, prefix: str = "") -> Model:
    """The model that `make` gives with the weights of `state` in float32, frozen and in
    evaluation mode.

    `path` and `prefix` complete the names in messages. Raises InputError for sizes that no model
    has, and for weights that are missing, unexpected or of another shape.
    """
    try:
        with torch.device("meta"):
            model = make()
    except RuntimeError as error:
        raise InputError(f"not the sizes of a model ({error})", file=path) from None
    own = model.state_dict()
    for name in own.keys() & state.keys():
        if own[name].shape != state[name].shape:
            expected, received = tuple(own[name].shape), tuple(state[name].shape)
            raise InputError(file=path, field=prefix + name, expected=expected, received=received)
    missing = {name: own[name] for name in own.keys() - state.keys()}
    unexpected = {name: state[name] for name in state.keys() - own.keys()}
    if missing or unexpected:
        kinds = {"missing": missing, "unexpected": unexpected}
        parts = [f"{kind} weights {listed(part, prefix)}" for kind, part in kinds.items() if part]
        raise InputError("; ".join(parts), file=path)
    model.load_state_dict({name: tensor.float() for name, tensor in state.items()}, assign=True)
    return model.eval().requires_grad_(False)


def listed(state: State, prefix: str = "") -> str:
    """Names and shapes of the first weights, and how many more there are."""
    names = sorted(state)
    shown = ", ".join(f"{prefix}{name} {tuple(state[name].shape)}" for name in names[:_SHOWN])
    return shown if len(names) <= _SHOWN else f"{shown} and {len(names) - _SHOWN} more"


def shape(state: State, name: str, dims: int, path: Path) -> tuple[int, ...]:
    """The shape of a weight; InputError where there is none of that name with so many axes."""
    if name not in state or state[name].dim() != dims:
        received = tuple(state[name].shape) if name in state else listed(state) or "no weights"
        expected = f"a weight with {dims} axes"
        raise InputError(file=path, field=name, expected=expected, received=received)
    return tuple(state[name].shape)


def blocks(state: State, prefix: str) -> int:
    """How many blocks `<prefix><number>.…` there are."""
    names = (name.removeprefix(prefix) for name in state if name.startswith(prefix))
    return len({name.partition(".")[0] for name in names})


@contextmanager
def naming(file: Path) -> Iterator[None]:
    """Errors of the block name the file, those of configurations too."""
    try:
        yield
    except InputError as error:
        raise InputError(str(error).removeprefix(f"{file}: "), file=file) from None
