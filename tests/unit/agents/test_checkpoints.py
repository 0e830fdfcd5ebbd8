import json
from pathlib import Path
from typing import Any

import pytest
import safetensors.torch
import torch
from torch import Tensor

from vlnhijack.agents.checkpoints import load_agent, load_hamt, load_vit, save_agent
from vlnhijack.agents.hamt import Hamt
from vlnhijack.agents.hamt_config import HamtConfig
from vlnhijack.agents.vit import VisionTransformer, VitConfig
from vlnhijack.agents.vocabulary import Vocabulary
from vlnhijack.errors import InputError

CONFIG = HamtConfig(
    hidden_size=8,
    num_attention_heads=2,
    intermediate_size=16,
    max_position_embeddings=10,
    vocab_size=9,
    max_action_steps=4,
    num_l_layers=1,
    num_x_layers=1,
    num_h_pano_layers=1,
    image_feat_size=8,
)
VIT = VitConfig((8, 12), patch=4, dim=8, depth=1, heads=2)
METADATA = {"clean": {"val_seen": 0.8}, "provenance": "a test"}


def saved(content: Any, tmp_path: Path) -> Path:
    torch.save(content, tmp_path / "checkpoint.pt")
    return tmp_path / "checkpoint.pt"


def agent_layout(state: dict[str, Tensor], prefix: str = "vln_bert.") -> dict[str, Any]:
    named = {f"{prefix}{name}": tensor for name, tensor in state.items()}
    return {"vln_bert": {"epoch": 3, "state_dict": named, "optimizer": {}}, "critic": {}}


def pretraining_layout(state: dict[str, Tensor]) -> dict[str, Tensor]:
    return {
        name if name.startswith("next_action.") else f"bert.{name}": tensor
        for name, tensor in state.items()
    } | {"mlm_head.predictions.bias": torch.zeros(9), "itm_head.net.0.weight": torch.zeros(2)}


@pytest.mark.parametrize(
    "layout",
    [
        agent_layout,
        lambda state: agent_layout(state, "module.vln_bert."),
        pretraining_layout,
        lambda state: pretraining_layout(state) | {"bert.vision_backbone.norm.bias": torch.ones(8)},
    ],
    ids=["agent", "parallel agent", "pretraining", "end-to-end pretraining"],
)
def test_every_official_layout_loads(layout: Any, tmp_path: Path) -> None:
    state = Hamt(CONFIG).state_dict()
    policy = load_hamt(saved(layout(state), tmp_path), CONFIG)
    assert all(torch.equal(tensor, state[name]) for name, tensor in policy.state_dict().items())
    assert not policy.training
    assert not any(parameter.requires_grad for parameter in policy.parameters())


def test_wrong_keys_are_listed(tmp_path: Path) -> None:
    state = Hamt(CONFIG).state_dict()
    state["next_action.net.5.bias"] = state.pop("next_action.net.4.bias")
    with pytest.raises(InputError, match=r"missing.*net\.4\.bias.*unexpected.*net\.5\.bias"):
        load_hamt(saved(agent_layout(state), tmp_path), CONFIG)


def test_wrong_shapes_are_named(tmp_path: Path) -> None:
    state = Hamt(CONFIG).state_dict()
    state["next_action.net.0.weight"] = torch.zeros(8, 7)
    with pytest.raises(InputError, match=r"next_action\.net\.0\.weight.*\(8, 8\).*\(8, 7\)"):
        load_hamt(saved(agent_layout(state), tmp_path), CONFIG)


@pytest.mark.parametrize(
    "content", [[1, 2], {"vln_bert": {"state_dict": {"name": 3}}}], ids=["list", "no tensors"]
)
def test_other_layouts_are_refused(content: Any, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="checkpoint.pt"):
        load_hamt(saved(content, tmp_path), CONFIG)


def test_unreadable_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        load_hamt(tmp_path / "absent.pt", CONFIG)
    (tmp_path / "broken.pt").write_text("not a checkpoint")
    with pytest.raises(InputError, match="broken.pt"):
        load_hamt(tmp_path / "broken.pt", CONFIG)


@pytest.mark.parametrize("prefix", ["", "bert.vision_backbone."])
def test_vit_loads_without_its_head(prefix: str, tmp_path: Path) -> None:
    state = VisionTransformer(VIT).state_dict()
    stored = {f"{prefix}{name}": tensor for name, tensor in state.items()}
    stored |= {"head.weight": torch.zeros(5, 8), "head.bias": torch.zeros(5)}
    vit = load_vit(saved({"state_dict": stored}, tmp_path), VIT)
    assert all(torch.equal(tensor, state[name]) for name, tensor in vit.state_dict().items())


@pytest.fixture
def agent_path(tmp_path: Path) -> Path:
    path = tmp_path / "small.safetensors"
    vocabulary = Vocabulary.build(["walk past the sofa and stop"])
    save_agent(path, VisionTransformer(VIT), Hamt(CONFIG), vocabulary, METADATA)
    return path


def test_saved_agent_comes_back(agent_path: Path) -> None:
    agent = load_agent(agent_path)
    assert agent.metadata == METADATA
    assert agent.vocabulary.tokens[4:] == ("and", "past", "sofa", "stop", "the", "walk")
    assert agent.policy.config == CONFIG
    assert agent.encoder.vit.config == VIT
    weights = safetensors.torch.load_file(agent_path)
    for name, tensor in agent.policy.state_dict().items():
        assert torch.equal(tensor, weights[f"hamt.{name}"])
    for name, tensor in agent.encoder.vit.state_dict().items():
        assert torch.equal(tensor, weights[f"vit.{name}"])


def test_agent_of_another_size_is_refused(agent_path: Path) -> None:
    description_path = agent_path.with_suffix(".json")
    description = json.loads(description_path.read_text())
    description["hamt"]["vocab_size"] = 11
    description_path.write_text(json.dumps(description))
    with pytest.raises(InputError, match=r"hamt\.embeddings\.word_.*\(11, 8\).*\(9, 8\)"):
        load_agent(agent_path)


def test_weights_of_another_agent_are_refused(agent_path: Path) -> None:
    weights = safetensors.torch.load_file(agent_path)
    weights["vit.norm.bias"] += 1
    agent_path.write_bytes(safetensors.torch.save(weights))
    with pytest.raises(InputError, match="small.json"):
        load_agent(agent_path)


@pytest.mark.parametrize("suffix", [".safetensors", ".json"])
def test_damaged_agent_files_are_refused(agent_path: Path, suffix: str) -> None:
    agent_path.with_suffix(suffix).write_text("{}")
    with pytest.raises(InputError, match="small"):
        load_agent(agent_path)
