"""Outputs and gradients of HAMT and its ViT against the original program's."""

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import torch.nn.functional as F
from torch import Tensor

from vlnhijack.agents.clip import ClipVisual
from vlnhijack.agents.encoder import CLIP, TIMM, Preprocessing, normalise
from vlnhijack.agents.hamt import Hamt
from vlnhijack.agents.hamt_config import HamtConfig
from vlnhijack.agents.official import read_checkpoint, sort_weights
from vlnhijack.agents.vit import VisionTransformer

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


def policy_of(path: Path, name: str) -> Hamt:
    return read_checkpoint(path).load_policy(config(name))


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
        state = full.history[:, 0]
        yield f"s{t}_state", state if policy.config.no_lang_ca else state * full.text[:, 0]
        step_loss = F.cross_entropy(logits, given[f"s{t}_target"], reduction="sum")
        yield f"s{t}_ce_sum", step_loss
        loss = loss + step_loss
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
    policy = policy_of(REFERENCE / f"{name}_agent_ckpt.pt", name).to(dtype)
    expected = arrays(f"{name}_outputs")
    prefix = "" if dtype == torch.float32 else "f64_"
    seen = set()
    for key, value in replay(policy, inputs(name, dtype)):
        if prefix + key in expected:
            assert_close(value, expected[prefix + key], TOLERANCE[dtype], key)
            seen.add(prefix + key)
    unchecked = {key for key in expected if key.startswith("f64_") == bool(prefix)} - seen
    assert {key.rsplit("_", 1)[1] for key in unchecked} <= {"value"}, "all but the critic's"


@pytest.mark.parametrize("detach", [False, True], ids=["fixhist0", "fixhist1"])
@each_dtype
@each_agent
def test_every_gradient_matches(name: str, dtype: torch.dtype, detach: bool) -> None:
    policy = policy_of(REFERENCE / f"{name}_agent_ckpt.pt", name).to(dtype)
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
    first, *others = (policy_of(path, name).state_dict() for path in paths)
    for other in others:
        assert all(torch.equal(first[key], other[key]) for key in first)


def test_end_to_end_layout_holds_policy_and_vit() -> None:
    path = REFERENCE / "e2e_pretrain_ckpt.pt"
    content = torch.load(path, weights_only=True)
    found = read_checkpoint(path)
    assert found.layout == "end-to-end pretraining"
    policy = found.load_policy(found.policy_config("r2r", {"num_attention_heads": 1})).state_dict()
    for key, tensor in policy.items():
        stored = key if key.startswith("next_action.") else f"bert.{key}"
        assert torch.equal(tensor, content[stored]), key
    vit = found.load_vision(found.vision_config({"heads": 1})).state_dict()
    for key, tensor in vit.items():
        assert torch.equal(tensor, content[f"bert.vision_backbone.{key}"]), key


@each_agent
def test_sizes_are_read_from_the_weights(name: str) -> None:
    hidden = ("num_attention_heads", "layer_norm_eps", "no_lang_ca")
    options = {option: getattr(config(name), option) for option in hidden}
    for layout in ("agent", "pretrain"):
        found = read_checkpoint(REFERENCE / f"{name}_{layout}_ckpt.pt")
        assert found.policy_config("r2r", options) == config(name)


def full_size_layouts() -> dict[str, dict[str, list[int]]]:
    files = [REFERENCE / f"full_keys_{kind}.json" for kind in ("agent", "vision_pretrain")]
    layouts = {name: keys for file in files for name, keys in json.loads(file.read_text()).items()}
    layouts.pop("critic")
    return layouts


def test_every_official_full_size_file_fits_as_it_is() -> None:
    """Names, shapes and the number of heads, of which weights show nothing."""
    policies, encoders = 0, 0
    for name, shapes in full_size_layouts().items():
        state = {key: torch.empty(shape, device="meta") for key, shape in shapes.items()}
        found = sort_weights(state, Path(name))
        if found.policy:
            variant = found.variant()
            assert variant == name.partition("_")[0]
            found.load_policy(found.policy_config(variant, {}))
            policies += 1
        if found.vit or found.clip:
            found.load_vision(found.vision_config({}))
            encoders += 1
    assert policies >= 4
    assert encoders >= 2


def vision(name: str) -> tuple[VisionTransformer | ClipVisual, dict[str, np.ndarray]]:
    """A recorded image encoder with its sizes, and what was recorded."""
    recorded = arrays(name)
    found = read_checkpoint(REFERENCE / f"{name}_ckpt.pt")
    heads = recorded["num_heads" if name == "vit" else "heads"]
    size = recorded["images_u8"].shape[-2:]
    model = found.load_vision(found.vision_config({"heads": int(heads), "image_size": size}))
    depth = {"dim": "embed_dim", "depth": "depth"}
    if name == "clip":
        depth = {option: option for option in ("width", "layers", "out", "patch")}
    for option, key in depth.items():
        assert getattr(model.config, option) == int(recorded[key]), option
    return model, recorded


@pytest.mark.parametrize(("name", "how"), [("vit", TIMM), ("clip", CLIP)])
def test_image_features_and_gradients_match(name: str, how: Preprocessing) -> None:
    model, recorded = vision(name)
    images = torch.from_numpy(recorded["images_u8"]) / 255
    images = normalise(images, how).requires_grad_()
    features = model(images)
    assert_close(features, recorded["features"], 1e-5, "features")
    (features * torch.from_numpy(recorded["loss_weight"])).sum().backward()
    assert images.grad is not None
    assert relative_error(images.grad, recorded["g_images"]) <= 1e-5
    if isinstance(model, VisionTransformer):
        assert_close(model.forward_tokens(images)[:, 0], recorded["features"], 1e-5, "tokens")
    if "f64_features" in recorded:
        exact = model.double()(images.detach().double())
        assert_close(exact, recorded["f64_features"], 1e-6, "float64 features")
