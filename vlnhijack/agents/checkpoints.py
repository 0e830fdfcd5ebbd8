"""Agents in our own form: a .safetensors file, a .json beside it, and maybe a tokenizer."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import safetensors
import safetensors.torch
from pydantic import BaseModel, PositiveInt, TypeAdapter

from vlnhijack import artifacts
from vlnhijack.agents.clip import ClipConfig, ClipVisual
from vlnhijack.agents.encoder import VitEncoder
from vlnhijack.agents.hamt import Hamt
from vlnhijack.agents.hamt_config import HamtConfig
from vlnhijack.agents.reader import MAX_TOKENS, Reader, TokenizerFile
from vlnhijack.agents.rollout import MAX_STEPS
from vlnhijack.agents.state import State, fill, naming
from vlnhijack.agents.vit import VisionTransformer, VitConfig
from vlnhijack.agents.vocabulary import Vocabulary
from vlnhijack.artifacts import validated
from vlnhijack.errors import InputError

_ANGLES = 4


@dataclass(frozen=True)
class Agent:
    """An agent. `vision` is its image encoder, if it has one; `max_steps` bounds its own moves;
    `metadata` holds its measured clean rates and its provenance.

    Raises InputError where its parts do not fit each other.
    """

    vision: VitEncoder | None
    policy: Hamt
    reader: Reader
    metadata: dict[str, Any]
    path: Path
    max_steps: int = MAX_STEPS

    def __post_init__(self) -> None:
        config = self.policy.config
        size = config.image_feat_size if self.vision is None else self.vision.feature_size
        known, moves = config.max_position_embeddings, config.max_action_steps
        for field, fits, expected, received in (
            ("image_feat_size", config.image_feat_size == size, size, config.image_feat_size),
            ("angle_feat_size", config.angle_feat_size == _ANGLES, _ANGLES, config.angle_feat_size),
            ("max_tokens", self.reader.max_tokens <= known, f"≤ {known}", self.reader.max_tokens),
            ("max_steps", self.max_steps <= moves, f"≤ {moves}", self.max_steps),
        ):
            if not fits:
                raise InputError(file=self.path, field=field, expected=expected, received=received)

    @property
    def encoder(self) -> VitEncoder:
        """The image encoder; InputError where the agent has none."""
        if self.vision is None:
            raise InputError(
                file=self.path,
                expected="an agent with an image encoder (vlnhijack agent convert --vision)",
                received="one without",
            )
        return self.vision


class Description(BaseModel):
    """The .json beside the weights; without vit and clip the agent reads stored features alone."""

    hamt: HamtConfig
    vit: VitConfig | None = None
    clip: ClipConfig | None = None
    image_size: tuple[PositiveInt, PositiveInt] | None = None
    max_tokens: PositiveInt = MAX_TOKENS
    max_steps: PositiveInt = MAX_STEPS
    metadata: dict[str, Any]
    weights_sha256: str
    tokenizer: bool = False
    vocabulary: tuple[str, ...] | None = None


_DESCRIPTION = TypeAdapter(Description)


def save_agent(agent: Agent) -> None:
    """Writes `agent.path` (.safetensors) and, beside it, a .json with all but the weights, and the
    tokenizer of a `TokenizerFile` as .tokenizer.json."""
    path, tokenizer = agent.path, agent.reader.tokenizer
    vit = None if agent.vision is None else agent.vision.vit
    parts = {"hamt": agent.policy, "clip" if isinstance(vit, ClipVisual) else "vit": vit}
    weights = {
        f"{part}.{name}": tensor.cpu().contiguous()
        for part, model in parts.items()
        if model is not None
        for name, tensor in model.state_dict().items()
    }
    artifacts.write_bytes(path, safetensors.torch.save(weights))
    if isinstance(tokenizer, TokenizerFile):
        artifacts.write_text(_tokenizer_path(path), tokenizer.text)
    description = Description(
        hamt=agent.policy.config,
        vit=vit.config if isinstance(vit, VisionTransformer) else None,
        clip=vit.config if isinstance(vit, ClipVisual) else None,
        image_size=None if agent.vision is None else agent.vision.image_size,
        max_tokens=agent.reader.max_tokens,
        max_steps=agent.max_steps,
        metadata=agent.metadata,
        weights_sha256=artifacts.sha256(path),
        tokenizer=isinstance(tokenizer, TokenizerFile),
        vocabulary=tokenizer.tokens if isinstance(tokenizer, Vocabulary) else None,
    )
    _write_description(path, description)


def load_agent(path: Path) -> Agent:
    """The agent that `save_agent` wrote to `path`, frozen and in evaluation mode.

    Raises InputError where a file is missing or damaged, or weights do not fit the description.
    """
    description = read_description(path)
    weights = _read_safetensors(path)
    tokenizer: Vocabulary | TokenizerFile | None = None
    if description.vocabulary is not None:
        with naming(path.with_suffix(".json")):
            tokenizer = Vocabulary(description.vocabulary)
    elif description.tokenizer:
        tokenizer = TokenizerFile(_tokenizer_path(path))
    agent = Agent(
        _load_vision(description, weights, path),
        fill(lambda: Hamt(description.hamt), _part(weights, "hamt."), path, "hamt."),
        Reader(tokenizer, description.hamt.vocab_size, description.max_tokens),
        description.metadata,
        path,
        description.max_steps,
    )
    if artifacts.sha256(path) != description.weights_sha256:
        expected = f"the weights named in {path.with_suffix('.json').name}"
        raise InputError(file=path, expected=expected, received="others")
    return agent


def record_metadata(path: Path, values: dict[str, Any]) -> None:
    """Write further metadata beside the weights at `path`."""
    description = read_description(path)
    description.metadata.update(values)
    _write_description(path, description)


def read_description(path: Path) -> Description:
    """All but the weights of the agent at `path`; InputError where it is missing or wrong."""
    file = path.with_suffix(".json")
    with naming(file):
        return validated(_DESCRIPTION, artifacts.read_json(file), file)


def _write_description(path: Path, description: Description) -> None:
    artifacts.write_json(path.with_suffix(".json"), description.model_dump())


def _load_vision(description: Description, weights: State, path: Path) -> VitEncoder | None:
    vit: VisionTransformer | ClipVisual
    if description.clip is not None:
        clip = description.clip
        vit = fill(lambda: ClipVisual(clip), _part(weights, "clip."), path, "clip.")
    elif description.vit is not None:
        config = description.vit
        vit = fill(lambda: VisionTransformer(config), _part(weights, "vit."), path, "vit.")
    else:
        return None
    return VitEncoder(vit, description.image_size)


def _tokenizer_path(path: Path) -> Path:
    return path.with_suffix(".tokenizer.json")


def _read_safetensors(path: Path) -> State:
    try:
        return safetensors.torch.load_file(path)
    except FileNotFoundError:
        raise InputError(file=path, expected="agent weights", received="no such file") from None
    except safetensors.SafetensorError as error:
        raise InputError(f"not a readable safetensors file ({error})", file=path) from None


def _part(weights: State, prefix: str) -> State:
    return {
        name.removeprefix(prefix): tensor
        for name, tensor in weights.items()
        if name.startswith(prefix)
    }
