"""Proxy tasks that teach a ViT what a view shows: categories, their extent, depth and room."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import torch
import torch.nn.functional as F
from numpy.typing import NDArray
from torch import Tensor, nn

from vlnhijack import seeds
from vlnhijack.agents.encoder import normalise
from vlnhijack.agents.vit import VisionTransformer
from vlnhijack.errors import CheckError


@dataclass(frozen=True, eq=False)
class ViewTargets:
    """Views and what they show, V of them with P = rows·columns patches and C categories.

    images (V,3,h,w) uint8; patch_fractions (V,P,C+1) float32, share of every category (last:
    background) in a patch; patch_depth (V,P) float32, mean log-depth in log-metres; rooms (V,)
    int64, label of the room that the camera stands in.
    """

    images: Tensor
    patch_fractions: Tensor
    patch_depth: Tensor
    rooms: Tensor


class ProxyHeads(nn.Module):
    """Linear heads: per patch category and log-depth; per view presence, extent and room."""

    def __init__(self, dim: int, categories: int, rooms: int) -> None:
        super().__init__()
        self.patch = nn.Linear(dim, categories + 2)
        self.view = nn.Linear(dim, 2 * categories + rooms)
        self.sizes = [categories, categories, rooms]

    def loss(self, tokens: Tensor, fractions: Tensor, depth: Tensor, rooms: Tensor) -> Tensor:
        """Weighted sum of the five losses for tokens (V,1+P,D); presence, a mean over many
        categories that are mostly absent, weighs most."""
        patch = self.patch(tokens[:, 1:])
        present_logit, extent, room = self.view(tokens[:, 0]).split(self.sizes, dim=1)
        share = fractions[..., :-1].mean(1)
        present = (share > 0.004).float()
        return (
            F.cross_entropy(patch[..., :-1].flatten(0, 1), fractions.flatten(0, 1))
            + F.mse_loss(patch[..., -1], depth)
            + 5 * F.binary_cross_entropy_with_logits(present_logit, present)
            + F.mse_loss(extent, (share + 1e-3).log()) / 4
            + F.cross_entropy(room, rooms) / 2
        )


@dataclass(frozen=True)
class EncoderSchedule:
    """Epochs over all views, batch size, peak learning rate and weight decay of AdamW."""

    epochs: int = 12
    batch: int = 64
    lr: float = 1e-3
    weight_decay: float = 0.05


def train_encoder(
    vit: VisionTransformer,
    data: ViewTargets,
    categories: int,
    rooms: int,
    schedule: EncoderSchedule,
    seed: int,
) -> Iterator[tuple[int, float]]:
    """Train `vit` in place; yields (step, loss) after every step.

    Views are mirrored and their brightness and contrast jittered, so that the features do not
    hang on one exposure. Raises CheckError if the loss is not finite.
    """
    rng = seeds.stream(seed, "encoder")
    torch.manual_seed(seeds.integer(seed, "encoder", "heads"))
    heads = ProxyHeads(vit.config.dim, categories, rooms)
    parameters = [*vit.parameters(), *heads.parameters()]
    optimiser = torch.optim.AdamW(parameters, schedule.lr, weight_decay=schedule.weight_decay)
    steps = schedule.epochs * (len(data.images) // schedule.batch)
    schedule_lr = torch.optim.lr_scheduler.LambdaLR(optimiser, warmup_cosine(steps))
    vit.train()
    step = 0
    for _ in range(schedule.epochs):
        for rows in _batches(rng, len(data.images), schedule.batch):
            images, fractions, depth = _augment(data, rows, vit.config.grid, rng)
            tokens = vit.forward_tokens(normalise(images))
            loss = heads.loss(tokens, fractions, depth, data.rooms[rows])
            if not torch.isfinite(loss):
                raise CheckError(f"the encoder's loss is not finite at step {step}")
            optimiser.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(parameters, 1.0)
            optimiser.step()
            schedule_lr.step()
            step += 1
            yield step, loss.item()
    vit.eval()


def warmup_cosine(steps: int, warmup: float = 0.05) -> Callable[[int], float]:
    """Learning-rate factor of a step: a linear rise over 5 % of the steps, then a half cosine."""
    rise = max(1, int(steps * warmup))

    def factor(step: int) -> float:
        if step < rise:
            return (step + 1) / rise
        return 0.5 * (1 + math.cos(math.pi * min(1.0, (step - rise) / max(1, steps - rise))))

    return factor


def _batches(rng: np.random.Generator, count: int, batch: int) -> Iterator[Tensor]:
    order: NDArray[np.int64] = rng.permutation(count)
    for start in range(0, count - batch + 1, batch):
        yield torch.from_numpy(order[start : start + batch])


def _augment(
    data: ViewTargets, rows: Tensor, grid: tuple[int, int], rng: np.random.Generator
) -> tuple[Tensor, Tensor, Tensor]:
    images = data.images[rows].float() / 255
    gain = torch.from_numpy(rng.uniform(0.8, 1.25, (len(rows), 1, 1, 1))).float()
    tint = torch.from_numpy(rng.uniform(0.92, 1.08, (len(rows), 3, 1, 1))).float()
    images = (images * gain * tint).clamp(0, 1)
    fractions, depth = data.patch_fractions[rows], data.patch_depth[rows]
    mirrored = torch.from_numpy(rng.random(len(rows)) < 0.5)
    images = torch.where(mirrored[:, None, None, None], images.flip(-1), images)
    flipped = torch.arange(grid[0] * grid[1]).view(grid).flip(1).flatten()
    fractions = torch.where(mirrored[:, None, None], fractions[:, flipped], fractions)
    depth = torch.where(mirrored[:, None], depth[:, flipped], depth)
    return images, fractions, depth
