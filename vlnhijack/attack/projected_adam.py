"""Adam with the projection onto the ε-ball and onto [0,1] after each step (paper, section 3.1)."""

from collections.abc import Mapping

import torch
from torch import Tensor


class ProjectedAdam:
    """A texture (H,W,3) float32 under optimisation; only texels of `used` (H,W) ever change."""

    def __init__(
        self,
        original: Tensor,
        used: Tensor,
        *,
        epsilon: float,
        lr: float = 0.01,
        betas: tuple[float, float] = (0.9, 0.999),
    ) -> None:
        self.original = original
        self.used = used[..., None]
        self.lower = (original - epsilon).clamp(min=0)
        self.upper = (original + epsilon).clamp(max=1)
        self.value = original.clone().requires_grad_()
        self._adam = torch.optim.Adam([self.value], lr=lr, betas=betas)

    def step(self, gradient: Tensor) -> None:
        """Descend along the gradient (H,W,3), then project."""
        self.value.grad = torch.where(self.used, gradient, 0.0)
        self._adam.step()
        self.value.grad = None
        with torch.no_grad():
            self.value.copy_(torch.minimum(torch.maximum(self.value, self.lower), self.upper))

    def largest_change(self) -> float:
        """L∞ distance to the original texture."""
        return float((self.value.detach() - self.original).abs().max())

    def state(self) -> dict[str, Tensor]:
        """Texture, Adam's moments and step count."""
        kept = self._adam.state[self.value]
        return {
            "texture": self.value.detach().clone(),
            "exp_avg": kept["exp_avg"].clone(),
            "exp_avg_sq": kept["exp_avg_sq"].clone(),
            "step": kept["step"].clone(),
        }

    def load(self, state: Mapping[str, Tensor]) -> None:
        """Continue from `state()`."""
        with torch.no_grad():
            self.value.copy_(state["texture"])
        self._adam.state[self.value] = {
            name: state[name].clone() for name in ("exp_avg", "exp_avg_sq", "step")
        }
