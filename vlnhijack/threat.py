"""The threat model: what an attacker may change, where and what for (paper, sections 3, 3.2)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vlnhijack.navigation.episode import Episode

Texture = NDArray[np.float32]

_FLOAT32_LEVELS = 1e-4  # more than a float32 value can be off its 8-bit level, in levels


@dataclass(frozen=True)
class AttackInstance:
    """One attack: an object, the viewpoint where it strikes, and what the agent shall do there.

    trajectory holds the viewpoints after `viewpoint`; the empty trajectory is the single-step
    attack (STOP at once). train optimises, validation selects the checkpoint, test is neither's;
    every episode passes through `viewpoint`.
    """

    id: str
    scan: str
    object_id: str
    category: str
    viewpoint: str
    coverage: float
    trajectory: tuple[str, ...]
    train: tuple[Episode, ...]
    validation: tuple[Episode, ...]
    test: tuple[Episode, ...]

    @property
    def kind(self) -> str:
        """ "single_step" or "trajectory"."""
        return "trajectory" if self.trajectory else "single_step"

    @property
    def target_path(self) -> list[str]:
        """The attack trajectory with the attack viewpoint in front."""
        return [self.viewpoint, *self.trajectory]


def guide(instance: AttackInstance, episode: Episode) -> list[str]:
    """The episode's path up to the first visit of the attack viewpoint, that one included."""
    return list(episode.path[: episode.path.index(instance.viewpoint) + 1])


def project(texture: Texture, original: Texture, epsilon: float) -> Texture:
    """The nearest texture within |t − t₀| ≤ ε and [0,1] (paper, section 3.1)."""
    lower, upper = bounds(original, epsilon)
    return np.clip(texture, lower, upper)


def bounds(original: Texture, epsilon: float) -> tuple[Texture, Texture]:
    """Lower and upper texel values that the budget allows."""
    return np.maximum(original - np.float32(epsilon), 0), np.minimum(
        original + np.float32(epsilon), 1
    )


def quantise(texture: Texture, original: Texture, epsilon: float) -> Texture:
    """The texture rounded to 8 bit without leaving the ε-ball.

    original and epsilon as in `project`; values are multiples of 1/255.
    """
    exact = original.astype(np.float64)
    lower = np.ceil(np.maximum(exact - epsilon, 0) * 255 - _FLOAT32_LEVELS)
    upper = np.floor(np.minimum(exact + epsilon, 1) * 255 + _FLOAT32_LEVELS)
    levels = np.clip(np.rint(texture.astype(np.float64) * 255), lower, upper)
    return (levels / 255).astype(np.float32)


def violation(texture: Texture, original: Texture, epsilon: float) -> float:
    """How far the largest texel change exceeds ε; 0 or less is inside the budget."""
    change = np.abs(texture.astype(np.float64) - original.astype(np.float64)).max()
    return float(change - epsilon)
