"""Optimise one instance, keep its checkpoints, export the attacked house."""

import json
import time
from collections.abc import Iterator

import numpy as np
import torch
from rich.progress import TaskID
from safetensors.torch import load_file, save
from torch import Tensor

from vlnhijack import seeds
from vlnhijack.artifacts import (
    append_row,
    read_json,
    read_rows,
    write_bytes,
    write_json,
    write_text,
)
from vlnhijack.attack.attacked_views import AttackedViews
from vlnhijack.attack.objective import Objective, attack_objective
from vlnhijack.attack.optimise import (
    AttackSchedule,
    Iteration,
    Validation,
    optimise,
)
from vlnhijack.attack.projected_adam import ProjectedAdam
from vlnhijack.evaluation.evaluate import evaluate_instance
from vlnhijack.experiments.attacks import Attack
from vlnhijack.experiments.baseline import clean_features
from vlnhijack.experiments.context import Context
from vlnhijack.experiments.rungs import attack_renderer, unbiased_renderer
from vlnhijack.experiments.views import house_cameras
from vlnhijack.frames import Camera
from vlnhijack.navigation.views import VIEWS
from vlnhijack.rendering.fixed_illumination import FixedIlluminationRenderer
from vlnhijack.rendering.mitsuba_renderer import MitsubaRenderer
from vlnhijack.rendering.renderer import Renderer
from vlnhijack.scenes.exr import write_exr
from vlnhijack.scenes.house_files import save_house
from vlnhijack.scenes.uv_atlas import used_texels
from vlnhijack.threat import AttackInstance, Texture, quantise


def run_attack(context: Context, attack: Attack) -> float:
    """Run or finish an attack; the seconds that its optimisation took."""
    if attack.result.exists():
        return float(read_json(attack.result)["seconds"])
    settings, instance = context.config.attack, attack.instance
    original = context.houses[instance.scan].surface(instance.object_id).texture
    texture = _texture(context, instance, original)
    first = attack.last_iteration()
    elapsed = _resume(attack, texture, first)
    started = time.perf_counter() - elapsed
    task = context.progress.add_task(attack.id, total=settings.iterations, completed=first)
    for _ in _checkpointed(context, attack, texture, first, task, started):
        pass
    exported = exported_texture(context, attack)
    house = context.houses[instance.scan].with_texture(instance.object_id, exported)
    save_house(house, attack.house)
    seconds = time.perf_counter() - started
    write_json(attack.result, {"best": attack.best()._asdict(), "seconds": seconds})
    return seconds


def exported_texture(context: Context, attack: Attack) -> Texture:
    """The best checkpoint's texture (H,W,3) in 8 bits, inside the ε-ball."""
    instance = attack.instance
    original = context.houses[instance.scan].surface(instance.object_id).texture
    optimised = load_file(attack.state(attack.best().iteration))["texture"].numpy()
    return quantise(optimised, original, context.config.attack.epsilon)


def object_views(
    context: Context, instance: AttackInstance, viewpoints: list[str] | None = None
) -> tuple[Tensor, Tensor, list[Camera]]:
    """Views in which the object is seen, at the given viewpoints or at all of them.

    Their rows of the table (V,), view indices (V,) and cameras.
    """
    house = context.houses[instance.scan]
    column = [item.id for item in house.objects].index(instance.object_id)
    seen = context.coverage[instance.scan][:, :, column] > 0
    if viewpoints is not None:
        allowed = np.zeros(len(seen), bool)
        allowed[[house.graph.row(viewpoint) for viewpoint in viewpoints]] = True
        seen &= allowed[:, None]
    rows, views = np.nonzero(seen)
    height, width = context.agent.encoder.image_size
    cameras = house_cameras(house.graph, width, height)
    wanted = [cameras[VIEWS * row + view] for row, view in zip(rows, views, strict=True)]
    start = context.rows(instance.scan).start
    return torch.from_numpy(rows + start), torch.from_numpy(views), wanted


def attacked_views(
    context: Context, attack: Attack, viewpoints: list[str] | None, stream: str
) -> AttackedViews:
    """The object's views at the samples of the named stream; exact but for "attack"."""
    instance = attack.instance
    house = context.houses[instance.scan]
    rows, views, cameras = object_views(context, instance, viewpoints)
    is_attack = stream == "attack"
    make = attack_renderer if is_attack else unbiased_renderer
    agent = context.rounded_agent if is_attack else context.agent
    seed = context.seed("views", stream, instance.id)
    renderer = make(attack.rendering, house, instance.object_id, cameras, seed)
    clean = context.place(clean_features(context, instance.scan), instance.scan)
    return AttackedViews(renderer, agent.encoder, clean, rows, views)


def training(context: Context, attack: Attack) -> tuple[AttackedViews, Objective]:
    """What an attack optimises: the views that it renders, the loss of its training episodes."""
    instance = attack.instance
    near = instance.target_path[: context.config.attack.rendered_viewpoints]
    views = attacked_views(context, attack, near, "attack")
    agent = context.rounded_agent
    return views, attack_objective(agent, context.table, instance, instance.train, views)


def _texture(context: Context, instance: AttackInstance, original: np.ndarray) -> ProjectedAdam:
    settings = context.config.attack
    surface = context.houses[instance.scan].surface(instance.object_id)
    used = used_texels(surface.uv, surface.faces, *original.shape[:2])
    return ProjectedAdam(
        torch.from_numpy(original),
        torch.from_numpy(used),
        epsilon=settings.epsilon,
        lr=settings.lr,
        betas=settings.betas,
    )


def _checkpointed(
    context: Context,
    attack: Attack,
    texture: ProjectedAdam,
    first: int,
    task: TaskID,
    started: float,
) -> Iterator[Iteration]:
    settings, instance = context.config.attack, attack.instance
    schedule = AttackSchedule(**settings.model_dump(exclude={"rendered_viewpoints"}))
    views, objective = training(context, attack)
    validation = attacked_views(context, attack, None, "validation")
    held_out = attack_objective(
        context.agent, context.table, instance, instance.validation, validation
    )
    seed = context.seed("attack", instance.id)
    _renew(views.renderer, texture, attack.rendering.refresh_every, first, seed)
    for row in optimise(texture, views, objective, schedule, seed, first):
        append_row(attack.log, row._asdict())
        context.progress.update(
            task, completed=row.iteration, description=f"{attack.id}, loss {row.loss:.3f}"
        )
        if row.iteration % schedule.checkpoint_every == 0 or row.iteration == schedule.iterations:
            found = _validate(context, instance, validation, held_out, texture, row.iteration)
            _save_checkpoint(attack, texture, found, seed, time.perf_counter() - started)
        _renew(views.renderer, texture, attack.rendering.refresh_every, row.iteration, seed)
        yield row


def _renew(
    renderer: Renderer, texture: ProjectedAdam, refresh_every: int, iteration: int, seed: int
) -> None:
    """After an iteration: other camera rays for `prb`; after each `refresh_every`, other light for
    `fixed-illumination`."""
    is_due = refresh_every > 0 and iteration > 0 and iteration % refresh_every == 0
    if isinstance(renderer, MitsubaRenderer):
        renderer.seed = seeds.integer(seed, "camera rays", iteration)
    elif is_due and isinstance(renderer, FixedIlluminationRenderer):
        renderer.refresh(texture.value)


@torch.no_grad()
def _validate(
    context: Context,
    instance: AttackInstance,
    views: AttackedViews,
    objective: Objective,
    texture: ProjectedAdam,
    iteration: int,
) -> Validation:
    features = views.features(texture.value)
    loss = objective(features, torch.arange(len(objective.first))).mean()
    records = evaluate_instance(
        context.agent,
        context.table,
        features,
        instance,
        "attacked",
        {"Validation": instance.validation},
    )
    return Validation(iteration, float(np.mean([r.attack_ndtw for r in records])), loss.item())


def _save_checkpoint(
    attack: Attack, texture: ProjectedAdam, found: Validation, seed: int, seconds: float
) -> None:
    """Texture, Adam's state, and what the random streams hang on: seed and iteration."""
    streams = {"streams": f"seed {seed}, iteration {found.iteration}"}
    write_bytes(attack.state(found.iteration), save(texture.state(), streams))
    write_exr(attack.state(found.iteration).with_suffix(".exr"), texture.value.detach().numpy())
    append_row(attack.validations, {**found._asdict(), "seconds": seconds})


def _resume(attack: Attack, texture: ProjectedAdam, first: int) -> float:
    """Load the checkpoint of iteration `first` and forget what came after; seconds spent so far."""
    attack.folder.mkdir(parents=True, exist_ok=True)
    for path in (attack.log, attack.validations):
        kept = [row for row in read_rows(path) if row["iteration"] <= first]
        write_text(path, "".join(json.dumps(row) + "\n" for row in kept))
    if first == 0:
        return 0.0
    texture.load(load_file(attack.state(first)))
    validated = {row["iteration"]: row["seconds"] for row in read_rows(attack.validations)}
    return float(validated[first])
