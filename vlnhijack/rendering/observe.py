"""Many views of a house, without gradients."""

from collections.abc import Iterable, Sequence
from functools import cache
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from vlnhijack import display
from vlnhijack.frames import Camera
from vlnhijack.rendering.mitsuba_scene import MitsubaScene, shared_scene
from vlnhijack.rendering.samples import camera_rays, image_size, runs, views_sensor
from vlnhijack.rendering.variant import activate
from vlnhijack.scenes.house import House

LIT_DEPTH = 6


def render_views(
    house: House, cameras: Sequence[Camera], spp: int = 16, seed: int = 0
) -> torch.Tensor:
    """Images (V,3,h,w) float32 display values of V cameras of one size.

    Baked houses take primary rays alone, lit ones path tracing; `spp` is a square number. Raises
    InputError where the cameras differ in size.
    """
    width, height = image_size(cameras)
    images = np.empty((len(cameras), 3, height, width), np.float32)
    built, sensor = shared_scene(house), None
    for run in runs(cameras, spp, seed):
        sensor = sensor or views_sensor(run.cameras, spp)
        sensor.aim(run.cameras)
        radiance = _radiance(built, house.kind, sensor, run.seed, spp)
        radiance = radiance.reshape(-1, height, width, 3)[: len(cameras) - run.first]
        shown = radiance if house.kind == "baked" else display.encode(house.exposure * radiance)
        images[run.first : run.first + len(shown)] = shown.transpose(0, 3, 1, 2)
    return torch.from_numpy(images).clamp_(0, 1)


def _radiance(
    built: MitsubaScene, kind: str, sensor: Any, seed: int, spp: int
) -> NDArray[np.float32]:
    """Mean radiance (pixels, 3) in film order."""
    mi = activate()
    ray, _, sampler = camera_rays(sensor, seed, spp)
    if kind == "baked":
        interaction = built.scene.ray_intersect(ray, mi.RayFlags.All, True)
        radiance = interaction.emitter(built.scene).eval(interaction)
    else:
        radiance, _, _ = path_tracer().sample(built.scene, sampler, ray)
    return pixel_means(radiance, spp)


def pixel_means(channels: Iterable[Any], spp: int) -> NDArray[np.float32]:
    """Means (pixels, C) over the `spp` samples of every pixel of C Dr.Jit Floats."""
    import drjit as dr

    samples = list(channels)
    dr.eval(samples)
    sums = [np.array(dr.block_sum(channel, spp), np.float32) for channel in samples]
    return np.asarray(np.stack(sums, -1) / np.float32(spp), np.float32)


@cache
def path_tracer(max_depth: int = LIT_DEPTH) -> Any:
    return activate().load_dict({"type": "path", "max_depth": max_depth, "rr_depth": 3})
