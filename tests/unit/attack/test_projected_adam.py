import pytest
import torch
from torch import Tensor

from vlnhijack.attack.projected_adam import ProjectedAdam

SHAPE = (5, 4, 3)


def generator(seed: int) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


def texture(epsilon: float, lr: float = 0.05) -> tuple[ProjectedAdam, Tensor, Tensor]:
    """The optimiser, a texture with black and white texels, and which of them are used."""
    original = (torch.rand(SHAPE, generator=generator(0)) * 1.6 - 0.3).clamp(0, 1)
    assert (original == 0).any()
    assert (original == 1).any()
    used = torch.rand(SHAPE[:2], generator=generator(1)) < 0.7
    return ProjectedAdam(original, used, epsilon=epsilon, lr=lr), original, used


def gradients(count: int, seed: int) -> list[Tensor]:
    """Gradients that push every texel mostly one way, so that bounds are met."""
    push = torch.randn(SHAPE, generator=generator(seed))
    return [push + 0.3 * torch.randn(SHAPE, generator=generator(seed + k)) for k in range(count)]


@pytest.mark.parametrize("epsilon", [0.02, 0.3, 1.0])
@pytest.mark.parametrize("seed", [10, 100, 1000])
def test_the_texture_stays_in_the_ball_and_unused_texels_stay(epsilon: float, seed: int) -> None:
    adam, original, used = texture(epsilon)
    for gradient in gradients(40, seed):
        adam.step(gradient)
        value = adam.value.detach()
        projected = original + (value - original).clamp(-epsilon, epsilon)
        torch.testing.assert_close(value, projected.clamp(0, 1), rtol=0, atol=1e-7)
        assert torch.equal(value[~used], original[~used])
        assert adam.value.grad is None
    assert adam.largest_change() == pytest.approx(min(epsilon, 1.0), abs=0.1)
    assert (value[used] != original[used]).float().mean() > 0.5


def test_without_an_active_bound_it_is_adam() -> None:
    adam, original, used = texture(epsilon=10.0, lr=1e-4)
    inside = original.clamp(0.1, 0.9)
    adam = ProjectedAdam(inside, torch.ones_like(used), epsilon=0.5, lr=1e-4, betas=(0.8, 0.95))
    twin = inside.clone().requires_grad_()
    reference = torch.optim.Adam([twin], lr=1e-4, betas=(0.8, 0.95))
    for gradient in gradients(20, seed=3):
        adam.step(gradient)
        twin.grad = gradient
        reference.step()
    assert torch.equal(adam.value, twin)


def test_a_saved_state_continues_to_the_bit() -> None:
    steps = gradients(30, seed=5)
    whole, _, used = texture(epsilon=0.1, lr=0.004)
    for gradient in steps[:13]:
        whole.step(gradient)
    state = whole.state()
    kept = {name: tensor.clone() for name, tensor in state.items()}
    resumed, *_ = texture(epsilon=0.1, lr=0.004)
    resumed.load(state)
    for gradient in steps[13:]:
        whole.step(gradient)
        resumed.step(gradient)
    assert torch.equal(whole.value, resumed.value)
    free = (whole.value > whole.lower) & (whole.value < whole.upper)
    assert 0.1 < free[used].float().mean() < 0.9, "some texels met a bound"
    for name, tensor in kept.items():
        assert torch.equal(state[name], tensor), f"{name} was changed by later steps"
