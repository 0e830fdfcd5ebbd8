"""The official checkpoint layouts, and what is wrong with a bad file."""

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor

from tests.fuzz import refused_or_read
from tests.unit.agents.test_checkpoints import CLIP, CONFIG, VIT
from vlnhijack.agents.clip import ClipVisual
from vlnhijack.agents.hamt import Hamt
from vlnhijack.agents.official import read_checkpoint
from vlnhijack.agents.vit import VisionTransformer
from vlnhijack.errors import InputError

HEADS = {
    "mlm_head.predictions.bias": torch.zeros(9),
    "itm_head.net.0.weight": torch.zeros(2),
    "image_classifier.net.3.bias": torch.zeros(2),
    "regress_action.net.4.bias": torch.zeros(3),
    "sprel_head.net.4.bias": torch.zeros(2),
}
TEXT_TOWER = {
    "transformer.resblocks.0.ln_1.bias": torch.zeros(4),
    "token_embedding.weight": torch.zeros(5, 4),
    "positional_embedding": torch.zeros(7, 4),
    "ln_final.bias": torch.zeros(4),
    "text_projection": torch.zeros(4, 8),
    "logit_scale": torch.tensor(1.0),
    "input_resolution": torch.tensor(8),
}
POLICY_OPTIONS = {"num_attention_heads": 2}


def saved(content: Any, folder: Path) -> Path:
    torch.save(content, folder / "checkpoint.pt")
    return folder / "checkpoint.pt"


def named(state: Mapping[str, Tensor], prefix: str) -> dict[str, Tensor]:
    return {f"{prefix}{name}": tensor for name, tensor in state.items()}


def agent_layout(state: Mapping[str, Tensor], prefix: str = "vln_bert.") -> dict[str, Any]:
    training = {"epoch": 3, "state_dict": named(state, prefix), "optimizer": {}}
    return {"vln_bert": training, "critic": {"state_dict": {"state2value.0.bias": torch.ones(2)}}}


def pretraining_layout(state: Mapping[str, Tensor], module: str = "") -> dict[str, Tensor]:
    own = {
        name if name.startswith("next_action.") else f"bert.{name}": tensor
        for name, tensor in state.items()
    }
    return named(own | HEADS, module)


def end_to_end_layout(state: Mapping[str, Tensor]) -> dict[str, Tensor]:
    vit = VisionTransformer(VIT).state_dict() | {"head.bias": torch.zeros(5)}
    return pretraining_layout(state) | named(vit, "bert.vision_backbone.")


@pytest.mark.parametrize(
    ("layout", "name"),
    [
        (agent_layout, "fine-tuned agent"),
        (lambda state: agent_layout(state, "module.vln_bert."), "fine-tuned agent"),
        (pretraining_layout, "pretraining"),
        (lambda state: pretraining_layout(state, "module."), "pretraining"),
        (end_to_end_layout, "end-to-end pretraining"),
    ],
)
def test_every_layout_of_the_policy_loads(layout: Any, name: str, tmp_path: Path) -> None:
    state = Hamt(CONFIG).state_dict()
    found = read_checkpoint(saved(layout(state), tmp_path))
    assert found.layout == name
    config = found.policy_config("r2r", POLICY_OPTIONS)
    assert config == CONFIG
    policy = found.load_policy(config)
    assert all(torch.equal(tensor, state[name]) for name, tensor in policy.state_dict().items())
    assert not policy.training
    assert not any(parameter.requires_grad for parameter in policy.parameters())


def test_variants_differ_in_what_weights_do_not_show(tmp_path: Path) -> None:
    found = read_checkpoint(saved(agent_layout(Hamt(CONFIG).state_dict()), tmp_path))
    assert found.variant() is None
    rxr = found.policy_config("rxr", POLICY_OPTIONS)
    assert (rxr.no_lang_ca, rxr.layer_norm_eps) == (True, 1e-5)
    with pytest.raises(InputError, match="policy.num_attention_heads: expected to be given"):
        found.policy_config("rxr", {})
    with pytest.raises(InputError, match=r"policy\.heads: expected hidden_size, "):
        found.policy_config("rxr", {"heads": 2})
    with pytest.raises(InputError, match=r"policy: num_attention_heads: .*'many'"):
        found.policy_config("rxr", {"num_attention_heads": "many"})


@pytest.mark.parametrize("layout", ["timm", "end to end", "plain"])
def test_the_vit_loads_without_its_head(layout: str, tmp_path: Path) -> None:
    state = VisionTransformer(VIT).state_dict()
    stored: dict[str, Any] = {**state, "head.weight": torch.zeros(5, 8), "head.bias": torch.ones(5)}
    if layout == "timm":
        stored = {"state_dict": stored}
    if layout == "end to end":
        stored = named(stored, "bert.vision_backbone.")
    found = read_checkpoint(saved(stored, tmp_path))
    with pytest.raises(InputError, match="vision.heads: expected to be given"):
        found.vision_config({})
    config = found.vision_config({"heads": 2, "image_size": (8, 12)})
    assert config == VIT
    vit = found.load_vision(config)
    assert all(torch.equal(tensor, state[name]) for name, tensor in vit.state_dict().items())


@pytest.mark.parametrize("text_tower", [{}, TEXT_TOWER], ids=["visual", "whole"])
def test_clip_loads_in_half_precision(text_tower: dict[str, Tensor], tmp_path: Path) -> None:
    state = {name: tensor.half() for name, tensor in ClipVisual(CLIP).state_dict().items()}
    official = {name.replace("in_proj.", "in_proj_"): tensor for name, tensor in state.items()}
    found = read_checkpoint(saved(named(official, "visual.") | text_tower, tmp_path))
    assert found.layout == "CLIP"
    config = found.vision_config({"heads": 3, "image_size": (8, 12)})
    assert config == CLIP
    clip = found.load_vision(config).state_dict()
    assert all(torch.equal(tensor, state[name].float()) for name, tensor in clip.items())


def test_a_checkpoint_without_the_wanted_part_is_refused(tmp_path: Path) -> None:
    policy = read_checkpoint(saved(agent_layout(Hamt(CONFIG).state_dict()), tmp_path))
    with pytest.raises(InputError, match="expected a ViT, CLIP, .* received 'fine-tuned agent'"):
        policy.vision_config({})
    vit = read_checkpoint(saved(VisionTransformer(VIT).state_dict(), tmp_path))
    with pytest.raises(InputError, match="a pretraining of HAMT, received 'vision"):
        vit.policy_config("r2r", POLICY_OPTIONS)


def test_unexpected_weights_are_listed_with_their_shapes(tmp_path: Path) -> None:
    state = pretraining_layout(Hamt(CONFIG).state_dict())
    other = {"og_head.net.0.weight": torch.zeros(2, 3), "obj_linear.bias": torch.zeros(4)}
    expected = r"unexpected weights obj_linear\.bias \(4,\), og_head\.net\.0\.weight \(2, 3\)"
    with pytest.raises(InputError, match=expected):
        read_checkpoint(saved(state | other, tmp_path))
    with pytest.raises(InputError, match=r"no known layout .*og_head\.net\.0\.weight \(2, 3\)"):
        read_checkpoint(saved(other, tmp_path))


def test_wrong_names_and_shapes_are_listed(tmp_path: Path) -> None:
    state = Hamt(CONFIG).state_dict()
    state["next_action.net.5.bias"] = state.pop("next_action.net.4.bias")
    found = read_checkpoint(saved(agent_layout(state), tmp_path))
    expected = r"missing weights next_action\.net\.4\.bias \(1,\); unexpected .*net\.5\.bias \(1,\)"
    with pytest.raises(InputError, match=expected):
        found.load_policy(CONFIG)
    state = Hamt(CONFIG).state_dict()
    state["next_action.net.0.weight"] = torch.zeros(8, 7)
    found = read_checkpoint(saved(agent_layout(state), tmp_path))
    with pytest.raises(InputError, match=r"next_action\.net\.0\.weight.*\(8, 8\).*\(8, 7\)"):
        found.load_policy(CONFIG)


@pytest.mark.filterwarnings("ignore:.*torch.jit.script.*:DeprecationWarning")
def test_an_archive_with_code_is_refused_with_the_way_out(tmp_path: Path) -> None:
    torch.jit.script(torch.nn.Linear(2, 2)).save(str(tmp_path / "ViT-B-32.pt"))
    with pytest.raises(InputError, match=r"ViT-B-32\.pt: a TorchScript archive.*state_dict\(\)"):
        read_checkpoint(tmp_path / "ViT-B-32.pt")


@pytest.mark.parametrize(
    "content", [[1, 2], {"vln_bert": {"state_dict": {"name": 3}}}], ids=["list", "no tensors"]
)
def test_other_contents_are_refused(content: Any, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="checkpoint.pt"):
        read_checkpoint(saved(content, tmp_path))


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_checkpoint(tmp_path / "absent.pt")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("official")


def contents(*, legacy: bool) -> bytes:
    whole = io.BytesIO()
    state = agent_layout(Hamt(CONFIG).state_dict())
    torch.save(state, whole, _use_new_zipfile_serialization=not legacy)
    return whole.getvalue()


WHOLE = {"zip": contents(legacy=False), "legacy": contents(legacy=True)}


@settings(max_examples=80, deadline=None)
@given(
    st.sampled_from(sorted(WHOLE)),
    st.integers(0, 10**6),
    st.binary(min_size=1, max_size=16),
    st.booleans(),
)
def test_no_file_ends_in_a_traceback(
    folder: Path, form: str, at: int, junk: bytes, cut: bool
) -> None:
    whole = WHOLE[form]
    at %= len(whole)
    content = whole[:at] if cut else whole[:at] + junk + whole[at + len(junk) :]

    def read(path: Path) -> None:
        found = read_checkpoint(path)
        found.load_policy(found.policy_config("r2r", POLICY_OPTIONS))

    refused_or_read(folder / "checkpoint.pt", content, read)
