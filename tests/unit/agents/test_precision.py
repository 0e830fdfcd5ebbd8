import pytest
import torch
from torch import Tensor, nn

from tests.worlds import World, world
from vlnhijack.agents.precision import Linear, attend, default_precision, set_precision
from vlnhijack.agents.rollout import rows_of
from vlnhijack.agents.trajectory import history, read_instructions, step_logits, trajectories


def by_hand(query: Tensor, key: Tensor, value: Tensor, mask: Tensor | None) -> Tensor:
    scores = torch.einsum("bhqd,bhkd->bhqk", query, key) / query.shape[-1] ** 0.5
    weights = (scores if mask is None else scores + mask).softmax(-1)
    return torch.einsum("bhqk,bhkd->bhqd", weights, value)


@pytest.mark.parametrize("masked", [False, True])
@pytest.mark.parametrize(
    ("dtype", "tolerance"),
    [(torch.float32, 1e-5), (torch.bfloat16, 3e-2)],
    ids=["float32", "bfloat16"],
)
def test_attention_and_its_gradients_are_those_by_hand(
    dtype: torch.dtype, tolerance: float, masked: bool
) -> None:
    generator = torch.Generator().manual_seed(0)
    sizes = (3, 2, 5, 8), (3, 2, 7, 8), (3, 2, 7, 8)
    given = [torch.randn(size, generator=generator).to(dtype).requires_grad_() for size in sizes]
    exact = [part.detach().double().requires_grad_() for part in given]
    mask = torch.zeros(3, 1, 1, 7)
    mask[1, ..., 5:] = -10000.0
    mine = attend(*given, mask if masked else None)
    twin = by_hand(*exact, mask.double() if masked else None)
    assert mine.dtype == dtype
    torch.testing.assert_close(mine.double(), twin, rtol=tolerance, atol=tolerance)
    gradients = zip(
        torch.autograd.grad(mine.sum(), given), torch.autograd.grad(twin.sum(), exact), strict=True
    )
    for fast, slow in gradients:
        torch.testing.assert_close(fast.double(), slow, rtol=tolerance, atol=tolerance)


def test_some_channels_of_a_linear_layer() -> None:
    layer, tokens = Linear(4, 6), torch.randn(2, 3, 4)
    torch.testing.assert_close(layer(tokens, slice(2, 5)), layer(tokens)[..., 2:5])


def test_only_transformer_products_are_rounded() -> None:
    model = nn.Sequential(Linear(4, 4), nn.LayerNorm(4), nn.Linear(4, 4))
    set_precision(model, "bfloat16")
    assert [part.weight.dtype for part in model] == [torch.bfloat16, torch.float32, torch.float32]
    tokens = torch.randn(2, 4)
    assert (tokens + model[0](tokens)).dtype == torch.float32, "the sum of the residual"


def test_the_shipped_agents_width_stays_float32() -> None:
    assert [default_precision(width) for width in (128, 511, 512, 768)] == [
        "float32",
        "float32",
        "bfloat16",
        "bfloat16",
    ]


@pytest.mark.parametrize("no_lang_ca", [False, True], ids=["r2r", "rxr"])
def test_bfloat16_keeps_the_direction_of_the_gradient(no_lang_ca: bool) -> None:
    exact = gradient(world(no_lang_ca=no_lang_ca))
    given = world(no_lang_ca=no_lang_ca)
    set_precision(given.agent.policy, "bfloat16")
    rounded = gradient(given)
    assert rounded.dtype == torch.float32 and rounded.isfinite().all()
    assert not torch.equal(rounded, exact)
    assert torch.cosine_similarity(rounded.ravel(), exact.ravel(), 0) > 0.99


def gradient(given: World) -> Tensor:
    """Of the summed negative log-probabilities of STOP at the ends of some walks."""
    features, episodes = given.features.clone().requires_grad_(), given.episodes[::17]
    policy = given.agent.policy
    read = read_instructions(policy, given.agent.reader, episodes)
    paths = [rows_of(given.table, episode) for episode in episodes]
    walked = trajectories(given.table, paths, [episode.heading for episode in episodes])
    past = history(policy, given.table, features, walked)
    rows, last = torch.arange(len(episodes)), walked.lengths - 1
    logits = step_logits(policy, given.table, features, past, read, walked, rows, last)
    stops = given.table.stops[walked.viewpoints[rows, last]]
    loss = -logits.log_softmax(1)[rows, stops].sum()
    return torch.autograd.grad(loss, features)[0]
