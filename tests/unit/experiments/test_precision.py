from pathlib import Path

import pytest
import torch
from rich.progress import Progress

from vlnhijack.agents.checkpoints import Agent
from vlnhijack.errors import InputError
from vlnhijack.experiments.config import ExperimentConfig
from vlnhijack.experiments.context import Context, load_context
from vlnhijack.experiments.yaml_config import load_config


def loaded(folder: Path, *settings: str) -> Context:
    file = folder / "a.yaml"
    file.write_text("{name: a, instances: {kind: single_step, houses: [alder], count: 1}}")
    config = load_config(file, ExperimentConfig, settings)
    return load_context(config, folder, Progress(disable=True))


def precisions(agent: Agent) -> tuple[set[torch.dtype], set[torch.dtype]]:
    """Of the encoder's and of the policy's weights."""
    encoder, policy = agent.encoder.parameters(), agent.policy.parameters()
    return {part.dtype for part in encoder}, {part.dtype for part in policy}


def test_the_small_agent_multiplies_in_float32(tmp_path: Path) -> None:
    assert precisions(loaded(tmp_path).rounded_agent) == ({torch.float32}, {torch.float32})


def test_each_stage_of_the_attack_has_its_own_precision(tmp_path: Path) -> None:
    context = loaded(tmp_path, "precision.vision=bfloat16")
    rounded = context.rounded_agent
    assert precisions(rounded) == ({torch.float32, torch.bfloat16}, {torch.float32})
    assert rounded.encoder(torch.rand(1, 3, 96, 128)).dtype == torch.float32
    assert precisions(context.agent) == ({torch.float32}, {torch.float32}), "it is evaluated"


def test_other_precisions_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"precision.policy: expected 'float32' or 'bfloat16'"):
        loaded(tmp_path, "precision.policy=float16")
