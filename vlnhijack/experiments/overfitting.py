"""Does an attack overfit the camera rays that it was optimised at? Its loss at others tells."""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import torch

from vlnhijack.artifacts import read_json, write_json
from vlnhijack.experiments.attack_stage import exported_texture, training
from vlnhijack.experiments.attacks import Attack
from vlnhijack.experiments.context import Context
from vlnhijack.experiments.rungs import attack_renderer

_SEEDS = 8
_LEAST = 1e-6


def overfitting(context: Context, attack: Attack) -> dict[str, Any]:
    """Loss of a finished attack at its own camera rays and at others; measured once.

    Of the exported texture, over all training episodes, by the rung and samples per pixel of the
    attack; the light of a rung that renews it is that around the texture. `prb` draws other rays in
    every iteration, so that it has none of its own. See `loss_gap`.
    """
    if attack.overfitting.exists():
        return read_json(attack.overfitting)
    started = time.perf_counter()
    own, *others = (
        context.seed("views", stream, attack.instance.id)
        for stream in ("attack", *(f"overfitting {k}" for k in range(_SEEDS)))
    )
    has_own = attack.rendering.rung != "prb"
    found = loss_gap(_loss(context, attack, own), own if has_own else None, *others)
    report = {**found, "seconds": time.perf_counter() - started}
    write_json(attack.overfitting, report)
    return report


def loss_gap(
    loss: Callable[[int], float], own: int | None, *others: int
) -> dict[str, float | None]:
    """What the loss at the seed `own` understates.

    loss_own_rays; loss_other_rays and deviation: mean and standard deviation over the other seeds;
    gap: the difference as a share of loss_own_rays (at least _LEAST nats). Without a seed of its
    own, loss_own_rays and gap are None.
    """
    at_own = None if own is None else loss(own)
    elsewhere = [loss(seed) for seed in others]
    mean = float(np.mean(elsewhere))
    return {
        "loss_own_rays": at_own,
        "loss_other_rays": mean,
        "deviation": float(np.std(elsewhere, ddof=1)),
        "gap": None if at_own is None else (mean - at_own) / max(at_own, _LEAST),
    }


def _loss(context: Context, attack: Attack, own: int) -> Callable[[int], float]:
    """The loss at the camera rays of a seed; the attack's renderer has those of `own`."""
    instance, settings = attack.instance, attack.rendering
    exported = exported_texture(context, attack)
    views, objective = training(context, attack)
    house = context.houses[instance.scan]
    if settings.refresh_every:
        house = house.with_texture(instance.object_id, exported)

    @torch.no_grad()
    def loss(seed: int) -> float:
        renderer = views.renderer
        if seed != own or settings.refresh_every:
            renderer = attack_renderer(settings, house, instance.object_id, renderer.cameras, seed)
        features = replace(views, renderer=renderer).features(torch.from_numpy(exported))
        return objective(features, torch.arange(len(objective.first))).mean().item()

    return loss
