"""Reads the official checkpoint layouts; writes and reads the small agent's own files."""

import pickle
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import safetensors
import safetensors.torch
import torch
from torch import Tensor, nn

from vlnhijack import artifacts
from vlnhijack.agents.encoder import VitEncoder
from vlnhijack.agents.hamt import Hamt
from vlnhijack.agents.hamt_config import HamtConfig
from vlnhijack.agents.vit import VisionTransformer, VitConfig
from vlnhijack.agents.vocabulary import Vocabulary
from vlnhijack.errors import InputError

_MODULE = "module."
_BACKBONE = "bert.vision_backbone."
_HAMT_PREFIXES = ("vln_bert.", "bert.")
_PRETRAINING_HEADS = ("mlm_head", "regress_action", "sprel_head", "image_classifier", "itm_head")
_SHOWN = 5

State = dict[str, Tensor]
Model = TypeVar("Model", bound=nn.Module)


@dataclass(frozen=True)
class Agent:
    """A trained agent. `metadata` holds its measured clean rates and its provenance."""

    encoder: VitEncoder
    policy: Hamt
    vocabulary: Vocabulary
    metadata: dict[str, Any]
    path: Path


def load_hamt(path: Path, config: HamtConfig) -> Hamt:
    """The policy, frozen and in evaluation mode, from any of HAMT's official layouts.

    Agent ({'vln_bert': {'state_dict'}}), pretraining and end-to-end pretraining (flat). Pretraining
    heads and the vision backbone are ignored. Raises InputError for anything else that is missing,
    unexpected or of another shape.
    """
    content = _read_torch(path)
    state = _tensors(content.get("vln_bert", content), path)
    ignored = (_BACKBONE, *(f"{head}." for head in _PRETRAINING_HEADS))
    state = {
        _strip(name, *_HAMT_PREFIXES): tensor
        for name, tensor in state.items()
        if not name.startswith(ignored)
    }
    return _fill(Hamt(config), state, path)


def load_vit(path: Path, config: VitConfig) -> VisionTransformer:
    """The ViT, frozen and in evaluation mode, from timm's keys or from an end-to-end pretraining
    checkpoint of HAMT; the classification head is ignored. Raises InputError as `load_hamt`."""
    state = _tensors(_read_torch(path), path)
    if any(name.startswith(_BACKBONE) for name in state):
        state = {name: tensor for name, tensor in state.items() if name.startswith(_BACKBONE)}
    state = {_strip(name, _BACKBONE): tensor for name, tensor in state.items()}
    state = {name: tensor for name, tensor in state.items() if not name.startswith("head.")}
    return _fill(VisionTransformer(config), state, path)


def save_agent(
    path: Path, vit: VisionTransformer, hamt: Hamt, vocabulary: Vocabulary, metadata: dict[str, Any]
) -> None:
    """Writes `path` (a .safetensors file) and, beside it, a .json with all but the weights."""
    weights = {f"vit.{name}": tensor for name, tensor in vit.state_dict().items()}
    weights |= {f"hamt.{name}": tensor for name, tensor in hamt.state_dict().items()}
    weights = {name: tensor.cpu().contiguous() for name, tensor in weights.items()}
    artifacts.write_bytes(path, safetensors.torch.save(weights))
    description = {
        "vit": vit.config.to_mapping(),
        "hamt": hamt.config.to_mapping(),
        "metadata": metadata,
        "weights_sha256": artifacts.sha256(path),
        "vocabulary": list(vocabulary.tokens),
    }
    artifacts.write_json(path.with_suffix(".json"), description)


def load_agent(path: Path) -> Agent:
    """The agent that `save_agent` wrote to `path`, frozen and in evaluation mode.

    Raises InputError where a file is missing or damaged, or weights do not fit the description.
    """
    description_path = path.with_suffix(".json")
    description = artifacts.read_json(description_path)
    try:
        vit = VisionTransformer(VitConfig(**description["vit"]))
        hamt = Hamt(HamtConfig.from_mapping(description["hamt"]))
        vocabulary = Vocabulary(tuple(description["vocabulary"]))
        metadata, digest = description["metadata"], description["weights_sha256"]
    except (KeyError, TypeError) as error:
        raise InputError(
            f"not the description of an agent ({error!r})", file=description_path
        ) from None
    weights = _read_safetensors(path)
    vit = _fill(vit, _part(weights, "vit."), path, "vit.")
    hamt = _fill(hamt, _part(weights, "hamt."), path, "hamt.")
    if artifacts.sha256(path) != digest:
        raise InputError(
            file=path, expected=f"the weights named in {description_path.name}", received="others"
        )
    return Agent(VitEncoder(vit), hamt, vocabulary, metadata, path)


def _fill(model: Model, state: State, path: Path, prefix: str = "") -> Model:
    """`model` with the weights of `state`, frozen; `prefix` completes the names in messages."""
    own = model.state_dict()
    for name in own.keys() & state.keys():
        if own[name].shape != state[name].shape:
            expected, received = tuple(own[name].shape), tuple(state[name].shape)
            raise InputError(file=path, field=prefix + name, expected=expected, received=received)
    missing, unexpected = own.keys() - state.keys(), state.keys() - own.keys()
    if missing or unexpected:
        kinds = {"missing": missing, "unexpected": unexpected}
        parts = [f"{kind} weights {_listed(n, prefix)}" for kind, n in kinds.items() if n]
        raise InputError("; ".join(parts), file=path)
    model.load_state_dict(state)
    return model.eval().requires_grad_(False)


def _listed(names: set[str], prefix: str) -> str:
    shown = ", ".join(prefix + name for name in sorted(names)[:_SHOWN])
    return shown if len(names) <= _SHOWN else f"{shown} and {len(names) - _SHOWN} more"


def _read_torch(path: Path) -> Mapping[str, Any]:
    try:
        content = torch.load(path, map_location="cpu", weights_only=True)
    except FileNotFoundError:
        raise InputError(file=path, expected="a checkpoint", received="no such file") from None
    except (pickle.UnpicklingError, RuntimeError, EOFError) as error:
        reason = str(error).partition("\n")[0]
        raise InputError(f"not a readable checkpoint ({reason})", file=path) from None
    if not isinstance(content, Mapping):
        raise InputError(file=path, expected="a dictionary", received=type(content).__name__)
    return content


def _tensors(content: Any, path: Path) -> State:
    """The flat name → tensor mapping of a checkpoint, names without `module.`."""
    if isinstance(content, Mapping):
        content = content.get("state_dict", content)
    if not isinstance(content, Mapping) or not all(map(torch.is_tensor, content.values())):
        raise InputError(file=path, expected="named tensors", received="another layout")
    return {_strip(name, _MODULE): tensor for name, tensor in content.items()}


def _read_safetensors(path: Path) -> State:
    try:
        return safetensors.torch.load_file(path)
    except FileNotFoundError:
        raise InputError(file=path, expected="agent weights", received="no such file") from None
    except safetensors.SafetensorError as error:
        raise InputError(f"not a readable safetensors file ({error})", file=path) from None


def _part(weights: State, prefix: str) -> State:
    return {_strip(n, prefix): tensor for n, tensor in weights.items() if n.startswith(prefix)}


def _strip(name: str, *prefixes: str) -> str:
    for prefix in prefixes:
        if name.startswith(prefix):
            return name.removeprefix(prefix)
    return name
