from pathlib import Path

import pytest
import torch
from rich.progress import Progress

from vlnhijack.errors import InputError
from vlnhijack.experiments.baseline import made_by
from vlnhijack.experiments.config import ExperimentConfig
from vlnhijack.experiments.context import Context, load_context
from vlnhijack.experiments.yaml_config import load_config


def loaded(folder: Path, *settings: str) -> Context:
    file = folder / "a.yaml"
    file.write_text("{name: a, instances: {kind: single_step, houses: [alder], count: 1}}")
    config = load_config(file, ExperimentConfig, settings)
    return load_context(config, folder, Progress(disable=True))


def test_the_small_agent_multiplies_in_float32(tmp_path: Path) -> None:
    context = loaded(tmp_path)
    assert context.precision == {"vision": "float32", "policy": "float32"}
    parts = [*context.agent.encoder.parameters(), *context.agent.policy.parameters()]
    assert {part.dtype for part in parts} == {torch.float32}


def test_each_stage_has_its_own_precision(tmp_path: Path) -> None:
    context = loaded(tmp_path, "precision.vision=bfloat16")
    block = context.agent.encoder.vit.blocks[0]
    assert block.attn.qkv.weight.dtype == torch.bfloat16
    assert {part.dtype for part in context.agent.policy.parameters()} == {torch.float32}
    assert context.agent.encoder(torch.rand(1, 3, 72, 96)).dtype == torch.float32
    assert made_by(context, "alder", 4, 0) != made_by(loaded(tmp_path), "alder", 4, 0)


def test_other_precisions_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"precision.policy: expected 'float32' or 'bfloat16'"):
        loaded(tmp_path, "precision.policy=float16")
