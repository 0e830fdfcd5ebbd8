"""An official checkpoint, taken over: read, converted, measured on stored features alone."""

import json
from pathlib import Path
from typing import Any

import pytest
import tokenizers
import torch
from typer.testing import CliRunner

from tests.worlds import VIT, World, world
from vlnhijack import seeds
from vlnhijack.agents.checkpoints import load_agent
from vlnhijack.agents.features import write_features
from vlnhijack.agents.reader import TokenizerFile
from vlnhijack.cli import app
from vlnhijack.evaluation.evaluate import mean_scores, navigate
from vlnhijack.navigation.episode import Episode, load_episodes, save_episodes
from vlnhijack.navigation.graph import save_graph

HEADS = ("--variant", "r2r", "--set", "policy.num_attention_heads=2")
VISION = ("--set", "vision.heads=2", "--set", "vision.image_size=[8, 12]")


@pytest.fixture(scope="module")
def given() -> World:
    return world(seed=3)


@pytest.fixture(scope="module")
def folder(given: World, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A researcher's files: agent, ViT, tokenizer, features, annotations, connectivity."""
    folder = tmp_path_factory.mktemp("files")
    policy = {f"vln_bert.{n}": t for n, t in given.agent.policy.state_dict().items()}
    torch.save({"vln_bert": {"state_dict": policy}, "critic": {}}, folder / "agent.pt")
    torch.save({"state_dict": given.agent.encoder.vit.state_dict()}, folder / "vit.pt")
    words = tokenizers.models.WordLevel({"[UNK]": 0, "walk": 1}, unk_token="[UNK]")
    tokenizers.Tokenizer(words).save(str(folder / "tokenizer.json"))
    rows = given.features.numpy().reshape(2, -1, 36, VIT.dim)
    scans = zip(given.table.graphs.values(), rows, strict=True)
    write_features(folder / "views.hdf5", scans, (480, 640))
    random = seeds.stream(0, "token ids")
    episodes = [
        Episode(**{**vars(episode), "encoding": tuple(random.integers(4, 15, 6).tolist())})
        for episode in given.episodes[::7]
    ]
    save_episodes(folder / "R2R_val_seen_enc.json", episodes)
    save_episodes(folder / "R2R_val_seen.json", given.episodes[::7])
    for graph in given.table.graphs.values():
        save_graph(graph, folder / "connectivity")
    return folder


def invoke(*arguments: Any) -> Any:
    return CliRunner().invoke(app, ["agent", *map(str, arguments)])


def convert(folder: Path, out: Path, *options: Any) -> Any:
    return invoke("convert", folder / "agent.pt", out, *HEADS, *options)


def measure(folder: Path, agent: Path, annotations: str) -> Any:
    files = ("--features", folder / "views.hdf5", "--connectivity", folder / "connectivity")
    return invoke("eval-features", agent, *files, "--annotations", folder / annotations, "--json")


def test_info_names_layout_and_sizes(folder: Path) -> None:
    found = json.loads(invoke("info", folder / "agent.pt", "--json").stdout)
    assert found["layout"] == "fine-tuned agent"
    assert (found["policy"]["hidden_size"], found["policy"]["num_x_layers"]) == (16, 2)
    assert "vision transformer" in invoke("info", folder / "vit.pt").stdout


def test_a_converted_agent_is_the_official_one(given: World, folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "mine.safetensors"
    files = ("--vision", folder / "vit.pt", "--tokenizer", folder / "tokenizer.json")
    done = convert(folder, out, *files, *VISION)
    assert done.exit_code == 0, done.stderr
    agent = load_agent(out)
    assert agent.encoder.image_size == (480, 640), "of the views that are rendered"
    assert (agent.reader.max_tokens, agent.max_steps) == (60, 15)
    assert isinstance(agent.reader.tokenizer, TokenizerFile)
    assert agent.metadata["converted_from"].keys() == {"policy", "vision", "tokenizer"}
    for ours, theirs in (
        (agent.policy, given.agent.policy),
        (agent.encoder.vit, given.agent.encoder.vit),
    ):
        for name, tensor in theirs.state_dict().items():
            assert torch.equal(ours.state_dict()[name], tensor)
    found = json.loads(invoke("info", out, "--json").stdout)
    assert (found["layout"], found["variant"]) == ("vlnhijack agent", "r2r")


def test_an_agent_takes_no_more_steps_than_its_policy_knows(folder: Path, tmp_path: Path) -> None:
    done = convert(folder, tmp_path / "far.safetensors", "--set", "max_steps=31")
    assert done.exit_code == 1
    assert "max_steps: expected ≤ 30, received 31" in done.stderr.replace("'", "")


def test_stored_features_measure_an_agent_without_an_encoder(
    given: World, folder: Path, tmp_path: Path
) -> None:
    out = tmp_path / "blind.safetensors"
    assert convert(folder, out).exit_code == 0
    done = measure(folder, out, "R2R_val_seen_enc.json")
    assert done.exit_code == 0, done.output + repr(done.exception)
    rates = json.loads(done.stdout)["R2R_val_seen_enc.json"]
    episodes = load_episodes(folder / "R2R_val_seen_enc.json", given.table.graphs)
    agent = load_agent(out)
    expected = mean_scores(navigate(agent, given.table, given.features, episodes))
    assert rates == pytest.approx(expected)
    assert 0 < rates["osr"] < 1


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--vision", "agent.pt"), "agent.pt: expected a ViT, CLIP"),
        (("--tokenizer", "agent.pt"), "agent.pt: not a"),
        (("--set", "policy.image_feat_size=7"), r"(48, 7)|(16, 7)"),
        (("--set", "heads=2"), "heads: expected no such key"),
    ],
)
def test_files_that_do_not_fit_are_refused(
    folder: Path, tmp_path: Path, options: tuple[str, str], message: str
) -> None:
    option, value = options
    given_value = folder / value if option != "--set" else value
    done = convert(folder, tmp_path / "mine.safetensors", option, given_value)
    assert done.exit_code == 1
    assert any(part in done.stderr for part in message.split("|")), done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_raw_text_without_a_tokenizer_is_one_line(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "mine.safetensors"
    convert(folder, out)
    done = measure(folder, out, "R2R_val_seen.json")
    assert done.exit_code == 1
    line = [line for line in done.stderr.splitlines() if line.startswith("vlnhijack: ")]
    assert "instr_encoding" in line[0] and "--tokenizer" in line[0]


def test_what_needs_images_says_that_there_is_no_encoder(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "mine.safetensors"
    convert(folder, out)
    assert "or --house" in invoke("eval", out).stderr
    assert "--tokenizer" in invoke("eval", out, "--house", "alder").stderr
