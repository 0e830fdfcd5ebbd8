"""Reload the attacked house, check that the texture was applied, evaluate every arm."""

import time
from collections.abc import Callable
from functools import lru_cache

import pandas as pd
import torch
from torch import Tensor

from vlnhijack.agents.view_cache import cached_views
from vlnhijack.artifacts import read_json, write_json
from vlnhijack.evaluation.apply_check import (
    check_other_samples,
    check_same_samples,
    check_texels,
)
from vlnhijack.evaluation.controls import noise_textures
from vlnhijack.evaluation.evaluate import evaluate_instance
from vlnhijack.evaluation.records import Record, load_records, save_records, to_frame
from vlnhijack.evaluation.tables import ATTACKED
from vlnhijack.experiments.attack_stage import exported_texture, object_views
from vlnhijack.experiments.attacks import Attack
from vlnhijack.experiments.baseline import clean_features, made_by
from vlnhijack.experiments.context import Context
from vlnhijack.experiments.rungs import unbiased_renderer
from vlnhijack.experiments.views import encode_cameras
from vlnhijack.rendering.observe import render_views
from vlnhijack.scenes.house import House
from vlnhijack.scenes.house_files import load_house
from vlnhijack.threat import AttackInstance, Texture

_SEEDS = 8


def evaluate(context: Context, attack: Attack) -> tuple[pd.DataFrame, float]:
    """Records of all arms and conditions of an attack, and the seconds it took."""
    records_file, report = attack.folder / "records.parquet", attack.folder / "evaluation.json"
    if report.exists():
        return load_records(records_file), float(read_json(report)["seconds"])
    started = time.perf_counter()
    attacked = load_house(attack.house)
    checks = apply_check(context, attack, attacked)
    features = _features(context, attack.instance, attacked)
    controls = _controls(context, attack.instance)
    frame = to_frame([*controls, *_records(context, attack.instance, ATTACKED, features)])
    save_records(records_file, frame)
    seconds = time.perf_counter() - started
    write_json(report, {"apply_check": checks, "seconds": seconds})
    return frame, seconds


def apply_check(context: Context, attack: Attack, attacked: House) -> dict[str, float]:
    """What was optimised is what lies on disk; raises CheckError where it is not."""
    instance, settings = attack.instance, attack.rendering
    original = context.houses[instance.scan]
    texture = exported_texture(context, attack)
    epsilon = context.config.attack.epsilon
    excess = check_texels(
        attacked, instance.object_id, texture, original.surface(instance.object_id).texture, epsilon
    )
    _, _, cameras = object_views(context, instance, [instance.viewpoint])

    def rendered(house: House, values: Texture, seed: int) -> Tensor:
        renderer = unbiased_renderer(settings, house, instance.object_id, cameras, seed)
        with torch.no_grad():
            return renderer(torch.from_numpy(values))

    def optimiser(seed: int) -> Tensor:
        return rendered(original, texture, seed)

    def seeds_of(render: Callable[[int], Tensor], stream: str) -> list[Tensor]:
        return [render(context.seed(stream, instance.id, k)) for k in range(_SEEDS)]

    def reloaded(seed: int) -> Tensor:
        return render_views(attacked, cameras, settings.attack_spp, seed)

    def reloaded_alike(seed: int) -> Tensor:
        """On lit houses by the optimiser's renderer: `render_views` traces other paths there."""
        if attacked.kind == "baked":
            return reloaded(seed)
        return rendered(attacked, attacked.surface(instance.object_id).texture, seed)

    seed = context.seed("apply", "same", instance.id)
    largest = check_same_samples(optimiser(seed), reloaded_alike(seed))
    smallest_p, tests = check_other_samples(
        seeds_of(optimiser, "apply optimiser"), seeds_of(reloaded, "apply reloaded")
    )
    return {
        "excess_over_epsilon": excess,
        "largest_difference_same_samples": largest,
        "smallest_p_other_samples": smallest_p,
        "tests_other_samples": tests,
    }


@lru_cache(maxsize=1)
def _controls(context: Context, instance: AttackInstance) -> list[Record]:
    """Records of the arms without an attack, the same for every attack of the instance."""
    house = context.houses[instance.scan]
    original = house.surface(instance.object_id).texture
    noise = noise_textures(
        original, context.config.attack.epsilon, context.seed("noise", instance.id)
    )
    clean = context.place(clean_features(context, instance.scan), instance.scan)
    records = _records(context, instance, "clean", clean)
    for name, texture in noise.items():
        changed = house.with_texture(instance.object_id, texture)
        records += _records(context, instance, name, _features(context, instance, changed))
    return records


def _records(
    context: Context, instance: AttackInstance, arm: str, features: Tensor
) -> list[Record]:
    conditions = {
        "Train": instance.train,
        "Validation": instance.validation,
        "Test": instance.test,
    }
    return evaluate_instance(context.agent, context.table, features, instance, arm, conditions)


def _features(context: Context, instance: AttackInstance, house: House) -> Tensor:
    """Features of a house that differs from the clean one in the object's texture alone.

    Views that do not see the object are the clean ones: the same house, the same samples.
    """
    rows, views, cameras = object_views(context, instance)
    spp = context.config.evaluation_spp
    seed = context.seed("views", "object", instance.id)
    seen = cached_views(
        context.folder / "features",
        f"{made_by(context, instance.scan, spp, seed)}, object {instance.object_id}",
        house.surface(instance.object_id).texture,
        torch.stack([rows, views], 1),
        lambda: encode_cameras(house, context.agent.encoder, cameras, spp, seed),
    )
    clean = context.place(clean_features(context, instance.scan), instance.scan)
    return clean.index_put((rows, views), seen)
