"""A researcher's own agent, from an official checkpoint to an attack.

The shipped agent is written in the official layouts, so what comes back is known.
"""

import json
import subprocess
import sys
from pathlib import Path

import pytest
import tokenizers
import torch

from vlnhijack.agents.checkpoints import Agent, load_agent
from vlnhijack.agents.vocabulary import Vocabulary
from vlnhijack.experiments.context import agent_file, episodes_of
from vlnhijack.scenes.house_files import load_house
from vlnhijack.settings import experiments_folder, house_folder

HOUSE = "alder"
ATTACK = (
    f"instances={{kind: single_step, houses: [{HOUSE}], count: 1}}",
    "attack.iterations=2",
    "attack.checkpoint_every=2",
    "rendering.evaluation_spp=4",
)


@pytest.fixture(scope="module")
def small() -> Agent:
    return load_agent(agent_file("small"))


@pytest.fixture(scope="module")
def files(small: Agent, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("official")
    policy = {f"module.vln_bert.{n}": t for n, t in small.policy.state_dict().items()}
    torch.save({"vln_bert": {"state_dict": policy}}, folder / "agent.pt")
    torch.save({"state_dict": small.encoder.vit.state_dict()}, folder / "vit.pt")
    assert isinstance(small.reader.tokenizer, Vocabulary)
    ids = {word: number for number, word in enumerate(small.reader.tokenizer.tokens)}
    made = tokenizers.Tokenizer(tokenizers.models.WordLevel(ids, unk_token="[UNK]"))
    made.normalizer = tokenizers.normalizers.Lowercase()
    words = tokenizers.Regex("[a-z0-9]+(?:'[a-z]+)?")
    made.pre_tokenizer = tokenizers.pre_tokenizers.Split(words, "removed", invert=True)
    made.post_processor = tokenizers.processors.TemplateProcessing(
        single="[CLS] $A [SEP]", special_tokens=[("[CLS]", ids["[CLS]"]), ("[SEP]", ids["[SEP]"])]
    )
    made.save(str(folder / "tokenizer.json"))
    return folder


def command(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    code = "from vlnhijack.cli import main; main()"
    parts = [sys.executable, "-c", code, *map(str, arguments)]
    return subprocess.run(parts, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def own(files: Path, small: Agent) -> Path:
    vit, hamt = small.encoder.vit.config, small.policy.config
    settings = (
        f"policy.num_attention_heads={hamt.num_attention_heads}",
        f"policy.layer_norm_eps={hamt.layer_norm_eps}",
        f"vision.heads={vit.heads}",
        f"vision.image_size={list(vit.image_size)}",
        f"view_size={list(small.encoder.image_size)}",
        "max_tokens=60",
        "max_steps=15",
    )
    sets = [part for setting in settings for part in ("--set", setting)]
    parts = ("--vision", files / "vit.pt", "--tokenizer", files / "tokenizer.json")
    out = files / "own.safetensors"
    assert small.policy.config.no_lang_ca
    done = command("agent", "convert", files / "agent.pt", out, *parts, "--variant", "rxr", *sets)
    assert done.returncode == 0, done.stderr
    return out


def test_the_converted_agent_reads_and_sees_the_same(own: Path, small: Agent) -> None:
    found = load_agent(own)
    for ours, theirs in ((found.policy, small.policy), (found.encoder, small.encoder)):
        for name, tensor in theirs.state_dict().items():
            assert torch.equal(ours.state_dict()[name], tensor), name
    folder = house_folder(HOUSE)
    episodes = episodes_of(load_house(folder), folder, "val_seen")
    for ours, theirs in zip(found.reader(episodes), small.reader(episodes), strict=True):
        assert torch.equal(ours, theirs)


@pytest.mark.slow
def test_it_is_measured_and_attacked(own: Path, small: Agent, tmp_path: Path) -> None:
    sets = [part for setting in (*ATTACK, f"agent={own}") for part in ("--set", setting)]
    run = ("run", experiments_folder() / "quickstart.yaml", *sets, "--out", tmp_path / "run")
    refused = command(*run)
    assert refused.returncode == 1
    assert f"--house {HOUSE} --record" in refused.stderr
    assert not (tmp_path / "run").exists()
    done = command("agent", "eval", own, "--house", HOUSE, "--record", "--spp", "4", "--json")
    assert done.returncode == 0, done.stderr
    rates = json.loads(done.stdout)[f"val_seen, {HOUSE}"]
    recorded = small.metadata["val_seen_by_house"][HOUSE]
    assert rates["n"] == recorded["n"]
    assert rates["sr"] == pytest.approx(recorded["sr"], abs=0.05), "other rays, the same agent"
    done = command(*run)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "run" / "summary.json").is_file()
