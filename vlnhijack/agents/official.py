"""The official checkpoint layouts of HAMT, timm's ViT and OpenAI's CLIP, and the sizes in them."""

import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from math import isqrt
from pathlib import Path
from typing import Any, Literal, TypeVar

import torch
from pydantic import TypeAdapter
from torch import Tensor

from vlnhijack.agents.clip import ClipConfig, ClipVisual
from vlnhijack.agents.hamt import Hamt
from vlnhijack.agents.hamt_config import HamtConfig
from vlnhijack.agents.state import State, blocks, fill, listed, naming, shape
from vlnhijack.agents.vit import VisionTransformer, VitConfig
from vlnhijack.artifacts import validated
from vlnhijack.errors import InputError

Variant = Literal["r2r", "rxr"]
Config = TypeVar("Config", HamtConfig, VitConfig, ClipConfig)
Part = Literal["policy", "vit", "clip", "ignored"]

# Layout, the prefix that it is known by, and where names with a prefix belong (the first that fits;
# the prefix is cut off the names of models, but for the pretraining's next_action).
_PRETRAINING_HEADS = ("mlm_head", "regress_action", "sprel_head", "image_classifier", "itm_head")
_CLIP_TEXT = ("transformer.", "token_embedding.", "positional_embedding", "ln_final.")
_CLIP_OTHER = ("text_projection", "logit_scale", "input_resolution", "context_length", "vocab_size")
_LAYOUTS: dict[str, tuple[str, dict[str, Part]]] = {
    "fine-tuned agent": ("vln_bert.", {"vln_bert.": "policy"}),
    "pretraining": (
        "bert.",
        {
            "bert.vision_backbone.head.": "ignored",
            "bert.vision_backbone.": "vit",
            "bert.": "policy",
            "next_action.": "policy",
            **{f"{head}.": "ignored" for head in _PRETRAINING_HEADS},
        },
    ),
    "CLIP": ("visual.", {"visual.": "clip", **dict.fromkeys(_CLIP_TEXT + _CLIP_OTHER, "ignored")}),
    "vision transformer": ("patch_embed.", {"head.": "ignored", "": "vit"}),
}
_KEPT = "next_action."
_HEAD_SIZE = 64  # of BERT, XLM-R, ViT-B and CLIP alike
_VARIANT_OF_WORDS: dict[int, Variant] = {30522: "r2r", 250002: "rxr"}
_VARIANT_OPTIONS: dict[Variant, dict[str, Any]] = {
    "r2r": {"no_lang_ca": False, "layer_norm_eps": 1e-12},
    "rxr": {"no_lang_ca": True, "layer_norm_eps": 1e-5},
}


@dataclass(frozen=True)
class Checkpoint:
    """An official checkpoint, sorted: weights of `Hamt`, `VisionTransformer` and `ClipVisual` under
    the names of these models, and the heads and text towers that are not needed."""

    path: Path
    layout: str
    policy: State = field(default_factory=dict)
    vit: State = field(default_factory=dict)
    clip: State = field(default_factory=dict)
    ignored: tuple[str, ...] = ()

    def variant(self) -> Variant | None:
        """The official agent with a vocabulary of that size; None where there is none."""
        return _VARIANT_OF_WORDS.get(self.policy_sizes()["vocab_size"])

    def policy_sizes(self) -> dict[str, Any]:
        """What the weights show of a HamtConfig; InputError where there is no policy."""
        if not self.policy:
            expected = "an agent or a pretraining of HAMT"
            raise InputError(file=self.path, expected=expected, received=self.layout)
        return _policy_sizes(self.policy, self.path)

    def vision_sizes(self) -> dict[str, Any]:
        """What they show of a VitConfig or ClipConfig; InputError where there is no encoder."""
        if not (self.vit or self.clip):
            expected = "a ViT, CLIP, or a checkpoint with its ViT"
            raise InputError(file=self.path, expected=expected, received=self.layout)
        sizes = _clip_sizes(self.clip, self.path) if self.clip else _vit_sizes(self.vit, self.path)
        return {name: size for name, size in sizes.items() if size is not None}

    def policy_config(self, variant: Variant, options: Mapping[str, Any]) -> HamtConfig:
        """Sizes as the weights have them, what they do not show as the variant has it; `options`
        go before both."""
        known = {**self.policy_sizes(), **_VARIANT_OPTIONS[variant], **options}
        return _config(HamtConfig, known, ("num_attention_heads",), self.path, "policy")

    def vision_config(self, options: Mapping[str, Any]) -> VitConfig | ClipConfig:
        """The same of the image encoder."""
        known = {**self.vision_sizes(), **options}
        needed = ("heads", "image_size")
        if self.clip:
            return _config(ClipConfig, known, needed, self.path, "vision")
        return _config(VitConfig, known, needed, self.path, "vision")

    def load_policy(self, config: HamtConfig) -> Hamt:
        """The policy, frozen; InputError where its weights are not those of the configuration."""
        return fill(lambda: Hamt(config), self.policy, self.path)

    def load_vision(self, config: VitConfig | ClipConfig) -> VisionTransformer | ClipVisual:
        """The image encoder; as `load_policy`."""
        if isinstance(config, ClipConfig):
            return fill(lambda: ClipVisual(config), self.clip, self.path, "visual.")
        return fill(lambda: VisionTransformer(config), self.vit, self.path)


def read_checkpoint(path: Path) -> Checkpoint:
    """Read and sort a checkpoint of any official layout, with or without `module.`.

    HAMT's fine-tuned agent, its pretraining (end to end: with the ViT), timm's ViT, OpenAI's CLIP.
    Nothing in the file is executed. Raises InputError for other layouts, with names and shapes.
    """
    content = _read_torch(path)
    return sort_weights(_tensors(content.get("vln_bert", content), path), path)


def sort_weights(state: State, path: Path) -> Checkpoint:
    """The same of the weights by name that the checkpoint at `path` holds."""
    for layout, (sign, places) in _LAYOUTS.items():
        if any(name.startswith(sign) for name in state):
            parts = _sorted(state, places, path)
            whole = "end-to-end pretraining" if parts["policy"] and parts["vit"] else layout
            ignored = tuple(parts.pop("ignored"))
            return Checkpoint(path, whole, **parts, ignored=ignored)
    known = ", ".join(_LAYOUTS)
    raise InputError(f"no known layout ({known}) with the weights {listed(state)}", file=path)


def _sorted(state: State, places: Mapping[str, Part], path: Path) -> dict[str, dict[str, Tensor]]:
    parts: dict[str, dict[str, Tensor]] = {"policy": {}, "vit": {}, "clip": {}, "ignored": {}}
    unexpected = {}
    for name, tensor in state.items():
        prefix = next((prefix for prefix in places if name.startswith(prefix)), None)
        if prefix is None:
            unexpected[name] = tensor
        elif places[prefix] == "ignored":
            parts["ignored"][prefix.rstrip(".")] = tensor
        elif prefix == _KEPT:
            parts["policy"][name] = tensor
        else:
            own = name.removeprefix(prefix).replace(".in_proj_", ".in_proj.")
            parts[places[prefix]][own] = tensor
    if unexpected:
        raise InputError(f"unexpected weights {listed(unexpected)}", file=path)
    return parts


def _config(
    kind: type[Config], known: Mapping[str, Any], needed: Sequence[str], path: Path, part: str
) -> Config:
    names = [field.name for field in fields(kind)]
    for name in sorted(known.keys() - set(names)):
        raise InputError(field=f"{part}.{name}", expected=", ".join(names), received=name)
    for name in [name for name in needed if name not in known]:
        expected = "to be given (--set), since the weights do not show it"
        raise InputError(file=path, field=f"{part}.{name}", expected=expected, received="nothing")
    with naming(path):
        return validated(TypeAdapter(kind), dict(known), path, part)


def _policy_sizes(state: State, path: Path) -> dict[str, Any]:
    def size(name: str, axis: int = 0) -> int:
        return shape(state, f"{name}.weight", 2, path)[axis]

    words, cross = "embeddings.word_embeddings", "encoder.x_layers."
    sizes = {
        "vocab_size": size(words),
        "hidden_size": size(words, 1),
        "num_attention_heads": _heads(size(words, 1)),
        "max_position_embeddings": size("embeddings.position_embeddings"),
        "type_vocab_size": size("embeddings.token_type_embeddings"),
        "image_feat_size": size("img_embeddings.img_linear", 1),
        "angle_feat_size": size("img_embeddings.ang_linear", 1),
        "max_action_steps": size("hist_embeddings.position_embeddings"),
        "intermediate_size": size(f"{cross}0.lang_inter.dense"),
        "num_l_layers": blocks(state, "encoder.layer."),
        "num_x_layers": blocks(state, cross),
        "num_h_pano_layers": blocks(state, "hist_embeddings.pano_encoder.layer."),
    }
    return {name: size for name, size in sizes.items() if size is not None}


def _vit_sizes(state: State, path: Path) -> dict[str, Any]:
    dim, _, _, patch = shape(state, "patch_embed.proj.weight", 4, path)
    return {
        "image_size": _square(shape(state, "pos_embed", 3, path)[1], patch),
        "patch": patch,
        "dim": dim,
        "depth": blocks(state, "blocks."),
        "heads": _heads(dim),
        "mlp_ratio": shape(state, "blocks.0.mlp.fc1.weight", 2, path)[0] / dim,
    }


def _clip_sizes(state: State, path: Path) -> dict[str, Any]:
    width, _, _, patch = shape(state, "conv1.weight", 4, path)
    return {
        "image_size": _square(shape(state, "positional_embedding", 2, path)[0], patch),
        "patch": patch,
        "width": width,
        "layers": blocks(state, "transformer.resblocks."),
        "heads": _heads(width),
        "out": shape(state, "proj", 2, path)[1],
    }


def _square(positions: int, patch: int) -> tuple[int, int] | None:
    """Pixels of the square image whose patches are one less than the positions, if there is one."""
    side = isqrt(max(positions - 1, 0))
    return (side * patch, side * patch) if side**2 == positions - 1 else None


def _heads(size: int) -> int | None:
    """As many as all official models of that size have; None for a size that none has."""
    return None if size % _HEAD_SIZE else size // _HEAD_SIZE


def _read_torch(path: Path) -> Mapping[str, Any]:
    if _is_torchscript(path):
        raise InputError(
            "a TorchScript archive, which holds code; save its weights alone: "
            "torch.save(torch.jit.load(file, 'cpu').state_dict(), 'weights.pt')",
            file=path,
        )
    try:
        content = torch.load(path, map_location="cpu", weights_only=True)
    except FileNotFoundError:
        raise InputError(file=path, expected="a checkpoint", received="no such file") from None
    except Exception:  # torch and pickle let many kinds through on damaged files
        expected, received = "a checkpoint of tensors alone", "another file, or a damaged one"
        raise InputError(file=path, expected=expected, received=received) from None
    if not isinstance(content, Mapping):
        raise InputError(file=path, expected="a dictionary", received=type(content).__name__)
    return content


def _is_torchscript(path: Path) -> bool:
    """Whether the file is an archive with code, as OpenAI ships CLIP."""
    try:
        with zipfile.ZipFile(path) as archive:
            return any(Path(name).name == "constants.pkl" for name in archive.namelist())
    except Exception:  # on a damaged archive many kinds; `torch.load` says what is wrong
        return False


def _tensors(content: Any, path: Path) -> State:
    """The flat name → tensor mapping of a checkpoint, names without `module.`."""
    if isinstance(content, Mapping):
        content = content.get("state_dict", content)
    if not isinstance(content, Mapping) or not all(map(torch.is_tensor, content.values())):
        raise InputError(file=path, expected="named tensors", received="another layout")
    return {str(name).removeprefix("module."): tensor for name, tensor in content.items()}
