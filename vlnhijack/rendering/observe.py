"""Many views of a house, without gradients."""

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
import torch

from vlnhijack import display
from vlnhijack.frames import Camera
from vlnhijack.rendering.mitsuba_scene import MitsubaScene, build_scene
from vlnhijack.rendering.samples import camera_rays, chunks, views_sensor
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
    width, height = cameras[0].width, cameras[0].height
    images = np.empty((len(cameras), 3, height, width), np.float32)
    built, sensor = build_scene(house), None
    for first, run in chunks(cameras, spp):
        sensor = sensor or views_sensor(run, spp)
        sensor.aim(run)
        radiance = _radiance(built, house.kind, sensor, seed + first, spp)
        radiance = radiance.reshape(len(run), height, width, 3)[: len(cameras) - first]
        shown = radiance if house.kind == "baked" else display.encode(house.exposure * radiance)
        images[first : first + len(run)] = shown.transpose(0, 3, 1, 2)
    return torch.from_numpy(images).clamp_(0, 1)


def _radiance(
    built: MitsubaScene, kind: str, sensor: Any, seed: int, spp: int
) -> np.ndarray[Any, np.dtype[np.float32]]:
    """Mean radiance (pixels, 3) in film order."""
    mi = activate()
    import drjit as dr

    ray, sampler = camera_rays(sensor, seed, spp)
    if kind == "baked":
        interaction = built.scene.ray_intersect(ray, mi.RayFlags.All, True)
        radiance = interaction.emitter(built.scene).eval(interaction)
    else:
        radiance, _, _ = path_tracer().sample(built.scene, sampler, ray)
    pixels = [dr.block_sum(channel, spp) for channel in radiance]
    dr.eval(pixels)
    return np.stack([np.array(channel) for channel in pixels], -1) / np.float32(spp)


@cache
def path_tracer() -> Any:
    return activate().load_dict({"type": "path", "max_depth": LIT_DEPTH, "rr_depth": 3})
