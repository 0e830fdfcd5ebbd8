from typing import Any

import pytest
import torch
from torch import Tensor

from vlnhijack.agents.hamt import Hamt
from vlnhijack.agents.hamt_config import HamtConfig
from vlnhijack.agents.policy import text_rows

SIZES: dict[str, Any] = {
    "hidden_size": 16,
    "num_attention_heads": 2,
    "intermediate_size": 32,
    "max_position_embeddings": 20,
    "vocab_size": 30,
    "max_action_steps": 6,
    "num_l_layers": 1,
    "num_x_layers": 2,
    "num_h_pano_layers": 1,
    "image_feat_size": 8,
}
B, T, S, N = 3, 7, 2, 9


@pytest.fixture(params=[False, True], ids=["r2r", "rxr"])
def policy(request: pytest.FixtureRequest) -> Hamt:
    torch.manual_seed(0)
    policy = Hamt(HamtConfig(**SIZES, no_lang_ca=request.param)).eval()
    for parameter in policy.parameters():
        if parameter.dim() > 1:
            torch.nn.init.normal_(parameter, std=0.3)
    return policy


@pytest.fixture
def given() -> dict[str, Tensor]:
    generator = torch.Generator().manual_seed(1)
    nav_type = torch.zeros(B, N, dtype=torch.int64)
    nav_type[:, :3] = 1
    nav_type[:, 3] = 2
    nav_type[0, 2:4] = torch.tensor([2, 0])
    ob_mask = torch.ones(B, N, dtype=torch.bool)
    ob_mask[1, -2:] = False
    text_mask = torch.ones(B, T, dtype=torch.bool)
    text_mask[2, 4:] = False
    history_mask = torch.ones(B, S, dtype=torch.bool)
    history_mask[1, 1:] = False
    return {
        "token_ids": torch.randint(1, 30, (B, T), generator=generator),
        "text_mask": text_mask,
        "image": torch.randn(B, 8, generator=generator),
        "angle": torch.randn(B, 4, generator=generator),
        "pano_image": torch.randn(B, 36, 8, generator=generator),
        "pano_angle": torch.randn(B, 36, 4, generator=generator),
        "history_mask": history_mask,
        "ob_image": torch.randn(B, N, 8, generator=generator),
        "ob_angle": torch.randn(B, N, 4, generator=generator),
        "nav_type": nav_type,
        "ob_mask": ob_mask,
    }


def arguments(policy: Hamt, given: dict[str, Tensor]) -> dict[str, Any]:
    """The arguments of a visual step after one step of history."""
    text = policy.encode_text(given["token_ids"], given["text_mask"])
    taken = [given[name] for name in ("image", "angle", "pano_image", "pano_angle")]
    token = policy.encode_history(*taken, torch.zeros(B, dtype=torch.int64))
    history = torch.stack([policy.history_cls(B), token], 1)
    names = ("text_mask", "history_mask", "ob_image", "ob_angle", "nav_type", "ob_mask")
    return {"text": text, "history": history, **{name: given[name] for name in names}}


def test_only_navigable_tokens_have_finite_logits(policy: Hamt, given: dict[str, Tensor]) -> None:
    logits = policy(**arguments(policy, given))
    assert torch.equal(torch.isfinite(logits), given["nav_type"] > 0)
    assert (logits[given["nav_type"] == 0] == -torch.inf).all()


def test_logits_equal_those_of_the_full_computation(policy: Hamt, given: dict[str, Tensor]) -> None:
    step = arguments(policy, given)
    torch.testing.assert_close(policy(**step), policy.outputs(**step).logits, rtol=1e-5, atol=1e-5)


def test_padding_is_never_read(policy: Hamt, given: dict[str, Tensor]) -> None:
    before = policy(**arguments(policy, given))
    given["ob_image"][1, -2:] = 100
    given["token_ids"][2, 4:] = 5
    step = arguments(policy, given)
    step["history"][1, 1:] = 100
    torch.testing.assert_close(policy(**step), before)


def test_views_that_are_no_candidate_are_read(policy: Hamt, given: dict[str, Tensor]) -> None:
    before = policy(**arguments(policy, given))
    given["ob_image"][0, 6] += 1
    assert not torch.allclose(policy(**arguments(policy, given))[0], before[0], atol=1e-4)


def test_gradients_flow_through_history(policy: Hamt, given: dict[str, Tensor]) -> None:
    for name in ("image", "pano_image", "ob_image"):
        given[name].requires_grad_()
    policy(**arguments(policy, given))[0, 0].backward()
    for name in ("image", "pano_image", "ob_image"):
        gradient = given[name].grad
        assert gradient is not None
        assert gradient[0].abs().max() > 0
        assert gradient[1:].abs().max() == 0


def test_history_of_all_steps_at_once(policy: Hamt, given: dict[str, Tensor]) -> None:
    taken = [given[name] for name in ("image", "angle", "pano_image", "pano_angle")]
    steps = torch.tensor([0, 3, 5])
    together = policy.encode_history(*taken, steps)
    for row, step in enumerate(steps):
        alone = policy.encode_history(*[part[row : row + 1] for part in taken], step[None])
        torch.testing.assert_close(together[row : row + 1], alone, rtol=1e-5, atol=1e-5)


def test_text_rows_may_repeat(policy: Hamt, given: dict[str, Tensor]) -> None:
    rows = torch.tensor([2, 0, 0])
    encoded = policy.encode_text(given["token_ids"], given["text_mask"])
    again = policy.encode_text(given["token_ids"][rows], given["text_mask"][rows])
    torch.testing.assert_close(text_rows(encoded, rows, T), again, rtol=1e-5, atol=1e-5)


def test_feature_dropout_acts_in_training_only(given: dict[str, Tensor]) -> None:
    rates = {"hidden_dropout": 0.0, "attention_dropout": 0.0, "feature_dropout": 0.5}
    policy = Hamt(HamtConfig(**SIZES, **rates))
    dropped = [policy(**arguments(policy.train(), given)) for _ in range(2)]
    kept = [policy(**arguments(policy.eval(), given)) for _ in range(2)]
    assert not torch.equal(*dropped)
    assert torch.equal(*kept)
