"""Agents in our own form."""

import json
from dataclasses import asdict, replace
from pathlib import Path

import pytest
import safetensors.torch
import torch
from hypothesis import HealthCheck, given, settings

from tests.fuzz import refused_or_read, texts
from vlnhijack.agents.checkpoints import Agent, load_agent, record_metadata, save_agent
from vlnhijack.agents.clip import ClipConfig, ClipVisual
from vlnhijack.agents.encoder import VitEncoder
from vlnhijack.agents.hamt import Hamt
from vlnhijack.agents.hamt_config import HamtConfig
from vlnhijack.agents.reader import Reader
from vlnhijack.agents.vit import VisionTransformer, VitConfig
from vlnhijack.agents.vocabulary import Vocabulary
from vlnhijack.errors import InputError

CONFIG = HamtConfig(
    hidden_size=8,
    num_attention_heads=2,
    intermediate_size=16,
    max_position_embeddings=10,
    vocab_size=9,
    max_action_steps=20,
    num_l_layers=1,
    num_x_layers=1,
    num_h_pano_layers=1,
    image_feat_size=8,
)
VIT = VitConfig((8, 12), patch=4, dim=8, depth=1, heads=2)
CLIP = ClipConfig((8, 12), patch=4, width=6, layers=2, heads=3, out=8)
METADATA = {"val_seen_by_house": {"alder": {"sr": 0.8}}, "provenance": "a test"}
READER = Reader(Vocabulary.build(["walk past the sofa"]), CONFIG.vocab_size, max_tokens=10)


def agent(path: Path, vision: VitEncoder | None, reader: Reader = READER) -> Agent:
    return Agent(vision, Hamt(CONFIG), reader, METADATA, path / "small.safetensors", 20)


@pytest.fixture
def agent_path(tmp_path: Path) -> Path:
    save_agent(agent(tmp_path, VitEncoder(VisionTransformer(VIT))))
    return tmp_path / "small.safetensors"


@pytest.mark.parametrize(
    "vision",
    [VitEncoder(VisionTransformer(VIT)), VitEncoder(ClipVisual(CLIP), (48, 64)), None],
    ids=["vit", "clip", "none"],
)
def test_a_saved_agent_comes_back(vision: VitEncoder | None, tmp_path: Path) -> None:
    given = agent(tmp_path, vision)
    save_agent(given)
    found = load_agent(given.path)
    assert (found.metadata, found.max_steps) == (METADATA, 20)
    assert found.reader == READER
    assert found.policy.config == CONFIG
    models = [(found.policy, given.policy)]
    if vision is not None:
        assert found.encoder.vit.config == vision.vit.config
        assert found.encoder.image_size == vision.image_size
        models.append((found.encoder.vit, vision.vit))
    for ours, theirs in models:
        assert not ours.training
        for name, tensor in theirs.state_dict().items():
            assert torch.equal(ours.state_dict()[name], tensor), name


def test_an_agent_without_an_encoder_says_so_when_it_should_look(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"small\.safetensors: .*--vision"):
        _ = agent(tmp_path, None).encoder


def test_parts_that_do_not_fit_each_other_are_refused(tmp_path: Path) -> None:
    narrow = VitEncoder(VisionTransformer(VitConfig((8, 12), patch=4, dim=6, depth=1, heads=2)))
    with pytest.raises(InputError, match="image_feat_size: expected 6, received 8"):
        agent(tmp_path, narrow)
    with pytest.raises(InputError, match="max_tokens: expected '≤ 10', received 11|≤ 10"):
        agent(tmp_path, None, Reader(None, 9, max_tokens=11))
    with pytest.raises(InputError, match="max_steps: expected ≤ 20, received 21|'≤ 20', rec"):
        replace(agent(tmp_path, None), max_steps=21)


def test_rates_are_recorded_beside_the_weights(agent_path: Path) -> None:
    record_metadata(agent_path, {"val_seen_by_house": {"birch": {"sr": 0.5}}})
    found = load_agent(agent_path).metadata
    assert found == {"val_seen_by_house": {"birch": {"sr": 0.5}}, "provenance": "a test"}


def test_agent_of_another_size_is_refused(agent_path: Path) -> None:
    description_path = agent_path.with_suffix(".json")
    description = json.loads(description_path.read_text())
    description["hamt"]["vocab_size"] = 11
    description_path.write_text(json.dumps(description))
    with pytest.raises(InputError, match=r"hamt\.embeddings\.word_.*\(11, 8\).*\(9, 8\)"):
        load_agent(agent_path)


def test_a_wrong_type_in_the_description_is_named(agent_path: Path) -> None:
    description_path = agent_path.with_suffix(".json")
    description = json.loads(description_path.read_text())
    description["hamt"]["hidden_size"] = "wide"
    description_path.write_text(json.dumps(description))
    with pytest.raises(InputError, match=r"small\.json: hamt\.hidden_size.*'wide'"):
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


FUNCTION_SCOPED = [HealthCheck.function_scoped_fixture]
DESCRIPTION = {
    "hamt": asdict(CONFIG),
    "vit": asdict(VIT),
    "metadata": {},
    "weights_sha256": "",
    "vocabulary": ["[PAD]", "[UNK]", "[CLS]", "[SEP]"],
}


@settings(max_examples=100, deadline=None, suppress_health_check=FUNCTION_SCOPED)
@given(texts(DESCRIPTION))
def test_no_description_ends_in_a_traceback(agent_path: Path, content: bytes) -> None:
    description_path = agent_path.with_suffix(".json")
    refused_or_read(description_path, content, lambda _: load_agent(agent_path))
