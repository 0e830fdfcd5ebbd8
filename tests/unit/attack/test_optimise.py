from collections.abc import Sequence

import pytest
import torch
from torch import Tensor

from tests.worlds import VIT, World, world
from vlnhijack.attack.attacked_views import AttackedViews
from vlnhijack.attack.objective import Objective, attack_objective
from vlnhijack.attack.optimise import (
    AttackSchedule,
    Iteration,
    Validation,
    batch_of,
    best,
    optimise,
)
from vlnhijack.attack.projected_adam import ProjectedAdam
from vlnhijack.errors import CheckError
from vlnhijack.frames import Camera
from vlnhijack.threat import AttackInstance

WHERE = "west05"
SEEN = 24
SCHEDULE = AttackSchedule(iterations=25, batch=4, epsilon=0.3, lr=0.03)


class BlurRenderer:
    """A toy `Renderer`: every pixel is a weighted mean of texels."""

    texture_shape = (6, 6, 3)
    cameras: Sequence[Camera] = ()

    def __init__(self) -> None:
        self.size = (SEEN, *VIT.image_size)
        pixels = SEEN * VIT.image_size[0] * VIT.image_size[1]
        weights = torch.randn(pixels, 36, generator=torch.Generator().manual_seed(0))
        self.weights = (3 * weights).softmax(1)

    def __call__(self, texture: Tensor) -> Tensor:
        return (self.weights @ texture.flatten(0, 1)).unflatten(0, self.size).movedim(-1, 1)


class BrokenRenderer(BlurRenderer):
    """Finite images whose gradient is not."""

    def __call__(self, texture: Tensor) -> Tensor:
        return super().__call__(texture) + (texture * 0).abs().sqrt().sum()


@pytest.fixture(scope="module")
def given() -> World:
    return world(seed=2)


def start() -> ProjectedAdam:
    original = torch.rand(6, 6, 3, generator=torch.Generator().manual_seed(1))
    used = torch.ones(6, 6, dtype=torch.bool)
    return ProjectedAdam(original, used, epsilon=SCHEDULE.epsilon, lr=SCHEDULE.lr)


def problem(given: World, renderer: BlurRenderer) -> tuple[AttackedViews, Objective]:
    through = tuple(e for e in given.episodes if WHERE in e.path)[::3]
    attack = AttackInstance("a", "west", "chair_0", "chair", WHERE, 0.5, (), through, (), ())
    row = given.table.index["west", WHERE]
    rows, views = torch.full((SEEN,), row), torch.arange(12, 12 + SEEN)
    seen = AttackedViews(renderer, given.agent.encoder, given.features, rows, views)
    return seen, attack_objective(given.agent, given.table, attack, through, seen)


def attack(given: World, texture: ProjectedAdam, first: int = 0) -> list[Iteration]:
    views, objective = problem(given, BlurRenderer())
    return list(optimise(texture, views, objective, SCHEDULE, seed=4, first=first))


def mean_loss(given: World, texture: Tensor) -> float:
    views, objective = problem(given, BlurRenderer())
    with torch.no_grad():
        losses = objective(views.features(texture), torch.arange(len(objective.first)))
    return losses.mean().item()


def test_an_attack_lowers_the_loss_more_than_noise_does(given: World) -> None:
    texture = start()
    rows = attack(given, texture)
    assert [row.iteration for row in rows] == list(range(1, 26))
    assert all(row.gradient_norm > 0 for row in rows)
    assert rows[-1].largest_change == texture.largest_change() <= SCHEDULE.epsilon + 1e-6
    random = torch.Generator().manual_seed(0)
    signs = torch.randint(0, 2, (20, *texture.original.shape), generator=random) * 2 - 1
    noise = (texture.original + SCHEDULE.epsilon * signs).clamp(0, 1)
    others = [mean_loss(given, other) for other in [texture.original, *noise]]
    assert mean_loss(given, texture.value) < min(others) - 0.01


def test_a_resumed_attack_ends_in_the_same_texture(given: World) -> None:
    whole = start()
    views, objective = problem(given, BlurRenderer())
    for row in optimise(whole, views, objective, SCHEDULE, seed=4):
        if row.iteration == 10:
            state = whole.state()
    resumed = start()
    resumed.load(state)
    rows = attack(given, resumed, first=10)
    assert rows[0].iteration == 11
    assert torch.equal(resumed.value, whole.value)


def test_only_the_rendered_rows_are_replaced(given: World) -> None:
    views, _ = problem(given, BlurRenderer())
    texture = start().value
    features = views.features(texture)
    changed = (features != given.features).any(-1)
    assert set(zip(*changed.nonzero().T.tolist(), strict=True)) == {
        (int(views.viewpoints[0]), view) for view in range(12, 12 + SEEN)
    }
    expected = given.agent.encoder(BlurRenderer()(texture))
    assert torch.equal(features[views.viewpoints, views.views], expected)


def test_a_gradient_that_is_not_finite_is_an_error(given: World) -> None:
    texture = start()
    views, objective = problem(given, BrokenRenderer())
    with pytest.raises(CheckError, match=r"iteration 1: the loss or its gradient is not finite"):
        next(optimise(texture, views, objective, SCHEDULE, seed=4))
    assert torch.equal(texture.value, texture.original)


@pytest.mark.parametrize(("episodes", "batch"), [(12, 4), (7, 3), (3, 8), (1, 2)])
def test_every_epoch_visits_each_episode_once(episodes: int, batch: int) -> None:
    visits = torch.cat([batch_of(9, k, episodes, batch) for k in range(1, episodes + 1)])
    epochs = visits.view(batch, episodes)
    assert torch.equal(epochs.sort(1).values, torch.arange(episodes).expand(batch, -1))


def test_every_epoch_and_every_seed_has_its_own_order() -> None:
    orders = [tuple(batch_of(seed, k, 10, 10).tolist()) for seed in (1, 2) for k in (1, 2, 3)]
    assert len(set(orders)) == 6


def test_the_best_checkpoint() -> None:
    checkpoints = [
        Validation(30, ndtw=0.4, loss=0.1),
        Validation(60, ndtw=0.7, loss=2.0),
        Validation(90, ndtw=0.7, loss=1.0),
        Validation(120, ndtw=0.7, loss=1.0),
    ]
    assert best(checkpoints).iteration == 90, "nDTW, then loss, then the earlier"
    assert best(checkpoints[::-1]).iteration == 90
    assert best(checkpoints[:2]).iteration == 60
