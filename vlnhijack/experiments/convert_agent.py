"""From the official checkpoints to an agent that every command takes."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import PositiveInt

from vlnhijack import __version__
from vlnhijack.agents.checkpoints import Agent, read_description, save_agent
from vlnhijack.agents.encoder import VitEncoder
from vlnhijack.agents.official import Checkpoint, Variant, read_checkpoint
from vlnhijack.agents.reader import Reader, TokenizerFile
from vlnhijack.artifacts import sha256
from vlnhijack.errors import InputError
from vlnhijack.experiments.yaml_config import Settings

# HAMT's --max_instr_len and --max_action_len (scripts/run_r2r.sh and run_rxr.sh)
_LIMITS: dict[Variant, tuple[int, int]] = {"r2r": (60, 15), "rxr": (250, 20)}


class ConvertSettings(Settings):
    """How to read an official checkpoint.

    variant: r2r (BERT) or rxr (XLM-R, no_lang_ca), known from an official vocabulary; policy and
    vision: options of HamtConfig, VitConfig or ClipConfig that the weights do not show; view_size:
    height and width of the views to render; max_tokens, max_steps: the variant's by default.
    """

    variant: Variant | None = None
    policy: dict[str, Any] = {}
    vision: dict[str, Any] = {}
    view_size: tuple[PositiveInt, PositiveInt] = (480, 640)
    max_tokens: PositiveInt | None = None
    max_steps: PositiveInt | None = None


def convert_agent(
    checkpoint: Path,
    vision: Path | None,
    tokenizer: Path | None,
    out: Path,
    settings: ConvertSettings,
) -> Agent:
    """Write the agent of an official checkpoint to `out` (.safetensors) and give it.

    Its image encoder is that of `vision`, else the one in the checkpoint; without either it can
    only be evaluated on stored features. Raises InputError where the files do not fit.
    """
    if out.suffix != ".safetensors":
        expected = "a name that ends in .safetensors"
        raise InputError(file=out, expected=expected, received=out.name)
    source = read_checkpoint(checkpoint)
    variant = _variant(source, settings)
    config = source.policy_config(variant, settings.policy)
    seeing = source if vision is None else read_checkpoint(vision)
    tokens, steps = _LIMITS[variant]
    reader = Reader(
        None if tokenizer is None else TokenizerFile(tokenizer),
        config.vocab_size,
        settings.max_tokens or min(tokens, config.max_position_embeddings),
    )
    files = {"policy": checkpoint, "vision": vision, "tokenizer": tokenizer}
    metadata = {"version": __version__, "variant": variant, "converted_from": _origins(files)}
    agent = Agent(
        _encoder(seeing, settings) if vision is not None or source.vit else None,
        source.load_policy(config),
        reader,
        metadata,
        out,
        settings.max_steps or min(steps, config.max_action_steps),
    )
    save_agent(agent)
    return agent


def agent_info(file: Path) -> dict[str, Any]:
    """What a checkpoint of any official layout, or an agent of ours (.safetensors), is.

    Sizes that the weights show, the variant where the vocabulary tells it, ignored weights.
    """
    if file.suffix == ".safetensors":
        return {"layout": "vlnhijack agent", **_own_info(file)}
    source = read_checkpoint(file)
    info: dict[str, Any] = {"layout": source.layout}
    if source.policy:
        info["variant"] = source.variant() or "not known from the vocabulary"
        info["policy"] = source.policy_sizes()
        info["policy_parameters"] = sum(tensor.numel() for tensor in source.policy.values())
    for name, part in (("vit", source.vit), ("clip", source.clip)):
        if part:
            info[name] = source.vision_sizes()
            info[f"{name}_parameters"] = sum(tensor.numel() for tensor in part.values())
    info["ignored"] = list(source.ignored)
    return info


def _own_info(file: Path) -> dict[str, Any]:
    found = read_description(file).model_dump(exclude_none=True)
    metadata = found.pop("metadata")
    found["vocabulary"] = len(found.pop("vocabulary", ()))
    recorded = metadata.get("val_seen_by_house", {})
    known = ("version", "variant", "converted_from")
    return {
        **found,
        **{name: metadata[name] for name in known if name in metadata},
        "recorded_sr": {house: rates["sr"] for house, rates in recorded.items()},
    }


def _origins(files: Mapping[str, Path | None]) -> dict[str, dict[str, str]]:
    return {
        part: {"file": file.name, "sha256": sha256(file)}
        for part, file in files.items()
        if file is not None
    }


def _variant(source: Checkpoint, settings: ConvertSettings) -> Variant:
    found = settings.variant or source.variant()
    if found is None:
        raise InputError(
            file=source.path,
            field="variant",
            expected="r2r or rxr, since the vocabulary is not an official one (--variant)",
            received="none",
        )
    return found


def _encoder(source: Checkpoint, settings: ConvertSettings) -> VitEncoder:
    config = source.vision_config(settings.vision)
    return VitEncoder(source.load_vision(config), settings.view_size)
