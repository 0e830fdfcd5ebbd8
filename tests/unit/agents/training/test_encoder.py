import numpy as np
import pytest
import torch
from torch import Tensor

from tests.worlds import VIT
from vlnhijack import seeds
from vlnhijack.agents.training.encoder import (
    EncoderSchedule,
    ViewTargets,
    _augment,
    train_encoder,
    warmup_cosine,
)
from vlnhijack.agents.vit import VisionTransformer
from vlnhijack.errors import CheckError

CATEGORIES, ROOMS, VIEWS = 2, 3, 24
SCHEDULE = EncoderSchedule(epochs=10, batch=8, lr=5e-3)


def views() -> ViewTargets:
    """Grey patches whose brightness tells their category and their depth."""
    random = seeds.stream(0, "views")
    rows, columns = VIT.grid
    level = torch.from_numpy(random.integers(20, 150, (VIEWS, rows, columns)))
    pixels = level.repeat_interleave(VIT.patch, 1).repeat_interleave(VIT.patch, 2)
    share = (level.flatten(1) / 150).float()
    fractions = torch.stack([share, torch.zeros_like(share), 1 - share], -1)
    return ViewTargets(
        images=pixels[:, None].expand(-1, 3, -1, -1).to(torch.uint8),
        patch_fractions=fractions,
        patch_depth=share,
        rooms=torch.arange(VIEWS) % ROOMS,
    )


def train(data: ViewTargets, seed: int, before: int = 0) -> tuple[list[float], Tensor]:
    """Losses and final weights of a training that finds torch's generator in any state."""
    torch.manual_seed(0)
    vit = VisionTransformer(VIT)
    torch.manual_seed(before)
    losses = [loss for _, loss in train_encoder(vit, data, CATEGORIES, ROOMS, SCHEDULE, seed)]
    return losses, torch.nn.utils.parameters_to_vector(vit.parameters()).detach()


def test_training_lowers_the_loss_and_repeats_itself() -> None:
    losses, weights = train(views(), seed=1)
    again, same_weights = train(views(), seed=1, before=7)
    assert len(losses) == SCHEDULE.epochs * VIEWS // SCHEDULE.batch
    assert np.mean(losses[-3:]) < 0.8 * np.mean(losses[:3])
    assert losses == again
    assert torch.equal(weights, same_weights)
    assert train(views(), seed=2)[0] != losses


def test_targets_are_mirrored_with_their_views() -> None:
    data = views()
    random = seeds.stream(0, "augment")
    images, fractions, depth = _augment(data, torch.arange(VIEWS), VIT.grid, random)
    patches = torch.nn.functional.avg_pool2d(images[:, :1], VIT.patch).flatten(1)
    exposure = patches / depth
    assert (exposure / exposure[:, :1] - 1).abs().max() < 1e-5, "one factor a view"
    assert exposure.std() > 0.05, "views differ in brightness"
    assert torch.equal(fractions[..., 0], depth)
    torch.testing.assert_close(fractions.sum(-1), torch.ones_like(depth))
    mirrored = (depth != data.patch_depth).any(1)
    assert 0 < mirrored.sum() < VIEWS
    flipped = data.patch_depth.unflatten(1, VIT.grid).flip(-1).flatten(1)
    assert torch.equal(depth[mirrored], flipped[mirrored])


def test_a_loss_that_is_not_finite_is_an_error() -> None:
    data = views()
    data.patch_depth[:] = torch.nan
    with pytest.raises(CheckError, match="encoder's loss is not finite at step 0"):
        train(data, seed=0)


def test_the_learning_rate_rises_then_falls_to_nothing() -> None:
    factors = [warmup_cosine(100)(step) for step in range(101)]
    assert factors[:5] == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0])
    assert factors[5] == max(factors)
    assert all(np.diff(factors[5:]) < 0)
    assert factors[-1] == pytest.approx(0)
