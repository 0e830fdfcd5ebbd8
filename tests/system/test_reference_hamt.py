"""Outputs and gradients of HAMT and its ViT against the original program's."""

import json
import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import torch.nn.functional as F
from torch import Tensor

from vlnhijack.agents.checkpoints import load_hamt, load_vit
from vlnhijack.agents.hamt import Hamt
from vlnhijack.agents.hamt_config import HamtConfig
from vlnhijack.agents.vit import VitConfig

SHARED = Path(__file__).resolve().parents[3] / "shared"
REFERENCE = Path(os.environ.get("VLNHIJACK_REFERENCE", SHARED / "reference")) / "hamt"
AGENTS = ("r2r", "rxr")
TOLERANCE = {torch.float32: 1e-5, torch.float64: 1e-9}

pytestmark = pytest.mark.skipif(
    not REFERENCE.is_dir(), reason=f"no reference data at {REFERENCE} (VLNHIJACK_REFERENCE)"
)
each_agent = pytest.mark.parametrize("name", AGENTS)
each_dtype = pytest.mark.parametrize("dtype", TOLERANCE, ids=["float32", "float64"])


def config(name: str) -> HamtConfig:
    return HamtConfig.from_mapping(
        json.loads((REFERENCE / "config.json").read_text())[name]["model"]
    )


def arrays(name: str) -> dict[str, np.ndarray]:
    with np.load(REFERENCE / f"{name}.npz") as file:
        return dict(file)


def inputs(name: str, dtype: torch.dtype) -> dict[str, Tensor]:
    """The recorded inputs; image features want gradients."""
    tensors = {key: torch.from_numpy(value) for key, value in arrays(f"{name}_inputs").items()}
    for key, tensor in tensors.items():
        if tensor.is_floating_point():
            tensors[key] = tensor.to(dtype).requires_grad_(key.endswith("img_feats"))
    return tensors


def replay(
    policy: Hamt, given: dict[str, Tensor], detach: bool = False
) -> Iterator[tuple[str, Any]]:
    """Named results in the order of the original: text, history CLS, visual step, history step…"""
    mask = given["txt_masks"]
    layers = policy.text_layers(given["txt_ids"], mask)
    if policy.config.no_lang_ca:
        yield from ((f"txt_embeds_{layer}", text) for layer, text in enumerate(layers))
    else:
        yield "txt_embeds", layers[0]
    text = policy.encode_text(given["txt_ids"], mask)
    yield "hist_cls", policy.history_cls(1)
    history, loss = [policy.history_cls(len(mask))], 0
    for t in range(int(given["n_visual"])):
        names = ("img_feats", "ang_feats", "nav_types", "masks")
        observation = [given[f"s{t}_ob_{part}"] for part in names]
        seen = torch.stack(history, 1), given[f"s{t}_hist_masks"]
        full = policy.outputs(text, mask, *seen, *observation)
        logits = policy(text, mask, *seen, *observation)
        yield from ((f"s{t}_logits", logits), (f"s{t}_logits", full.logits))
        yield from ((f"s{t}_txt_out", full.text), (f"s{t}_hist_out", full.history))
        yield f"s{t}_ob_out", full.observation
        loss = loss + F.cross_entropy(logits, given[f"s{t}_target"], reduction="sum")
        if t < int(given["n_history"]):
            names = ("img_feats", "ang_feats", "pano_img_feats", "pano_ang_feats")
            taken = [given[f"h{t}_hist_{part}"] for part in names]
            token = policy.encode_history(*taken, torch.full((len(mask),), t))
            yield f"h{t}_hist_embeds", token
            history.append(token.detach() if detach else token)
    yield "loss_sum", loss


def assert_close(received: Tensor, expected: np.ndarray, tolerance: float, name: str) -> None:
    mine = received.detach().numpy()
    assert mine.shape == expected.shape, name
    assert np.array_equal(np.isneginf(mine), np.isneginf(expected)), name
    finite = np.isfinite(expected)
    np.testing.assert_allclose(mine[finite], expected[finite], tolerance, tolerance, err_msg=name)


def relative_error(received: Tensor, expected: np.ndarray) -> float:
    return float(np.linalg.norm(received.numpy() - expected) / np.linalg.norm(expected))


@each_dtype
@each_agent
def test_every_output_matches(name: str, dtype: torch.dtype) -> None:
    policy = load_hamt(REFERENCE / f"{name}_agent_ckpt.pt", config(name)).to(dtype)
    expected = arrays(f"{name}_outputs")
    prefix = "" if dtype == torch.float32 else "f64_"
    seen = set()
    for key, value in replay(policy, inputs(name, dtype)):
        if prefix + key in expected:
            assert_close(value, expected[prefix + key], TOLERANCE[dtype], key)
            seen.add(prefix + key)
    unchecked = {key for key in expected if key.startswith("f64_") == bool(prefix)} - seen
    critic_or_parts = {"state", "value", "sum"}
    assert {key.rsplit("_", 1)[1] for key in unchecked} <= critic_or_parts


@pytest.mark.parametrize("detach", [False, True], ids=["fixhist0", "fixhist1"])
@each_dtype
@each_agent
def test_every_gradient_matches(name: str, dtype: torch.dtype, detach: bool) -> None:
    policy = load_hamt(REFERENCE / f"{name}_agent_ckpt.pt", config(name)).to(dtype)
    given = inputs(name, dtype)
    dict(replay(policy, given, detach))["loss_sum"].backward()
    prefix, rows = ("g_", slice(None)) if dtype == torch.float32 else ("g64b0_", slice(0, 1))
    checked = 0
    for key, expected in arrays(f"{name}_grads_fixhist{int(detach)}").items():
        if key.startswith(prefix):
            gradient = given[key.removeprefix(prefix)].grad
            assert gradient is not None, key
            assert relative_error(gradient[rows], expected) <= TOLERANCE[dtype], key
            checked += 1
    assert checked >= int(given["n_visual"])


@each_agent
def test_both_layouts_hold_the_same_policy(name: str, tmp_path: Path) -> None:
    agent_path = REFERENCE / f"{name}_agent_ckpt.pt"
    content = torch.load(agent_path, weights_only=True)
    state = content["vln_bert"]["state_dict"]
    content["vln_bert"]["state_dict"] = {f"module.{key}": value for key, value in state.items()}
    torch.save(content, tmp_path / "parallel.pt")
    paths = agent_path, REFERENCE / f"{name}_pretrain_ckpt.pt", tmp_path / "parallel.pt"
    first, *others = (load_hamt(path, config(name)).state_dict() for path in paths)
    for other in others:
        assert all(torch.equal(first[key], other[key]) for key in first)


def test_end_to_end_layout_holds_policy_and_vit() -> None:
    path = REFERENCE / "e2e_pretrain_ckpt.pt"
    content = torch.load(path, weights_only=True)
    features = content["bert.img_embeddings.img_linear.weight"].shape[1]
    policy = load_hamt(path, replace(config("r2r"), image_feat_size=features)).state_dict()
    for key, tensor in policy.items():
        stored = key if key.startswith("next_action.") else f"bert.{key}"
        assert torch.equal(tensor, content[stored]), key
    vit = load_vit(path, vit_config(content, "bert.vision_backbone.")).state_dict()
    for key, tensor in vit.items():
        assert torch.equal(tensor, content[f"bert.vision_backbone.{key}"]), key


@pytest.mark.parametrize("name", ["r2r_agent", "rxr_agent"])
def test_official_full_size_keys(name: str) -> None:
    keys = json.loads((REFERENCE / "full_keys_agent.json").read_text())[name]
    shapes = {key.removeprefix("vln_bert."): tuple(shape) for key, shape in keys.items()}
    words, size = shapes["embeddings.word_embeddings.weight"]
    full = HamtConfig(
        hidden_size=size,
        vocab_size=words,
        max_position_embeddings=shapes["embeddings.position_embeddings.weight"][0],
        image_feat_size=shapes["img_embeddings.img_linear.weight"][1],
        no_lang_ca=name.startswith("rxr"),
    )
    with torch.device("meta"):
        policy = Hamt(full)
    assert {key: tuple(value.shape) for key, value in policy.state_dict().items()} == shapes


def vit_config(state: dict[str, Tensor], prefix: str = "") -> VitConfig:
    """Sizes of the recorded ViT, the patch size from its weights."""
    recorded = arrays("vit")
    return VitConfig(
        image_size=recorded["images_u8"].shape[-2:],
        patch=state[f"{prefix}patch_embed.proj.weight"].shape[-1],
        dim=int(recorded["embed_dim"]),
        depth=int(recorded["depth"]),
        heads=int(recorded["num_heads"]),
    )


def test_vit_features_and_gradients_match() -> None:
    path = REFERENCE / "vit_ckpt.pt"
    recorded = arrays("vit")
    vit = load_vit(path, vit_config(torch.load(path, weights_only=True)["state_dict"]))
    images = (torch.from_numpy(recorded["images_u8"]) / 255 * 2 - 1).requires_grad_()
    features = vit(images)
    assert_close(features, recorded["features"], 1e-5, "features")
    assert_close(vit.forward_tokens(images)[:, 0], recorded["features"], 1e-5, "tokens")
    (features * torch.from_numpy(recorded["loss_weight"])).sum().backward()
    assert images.grad is not None
    assert relative_error(images.grad, recorded["g_images"]) <= 1e-5
    exact = vit.double()(images.detach().double())
    assert_close(exact, recorded["f64_features"], 1e-6, "float64 features")
