"""The exact picture of a baked house for one frozen choice of camera rays."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from scipy import sparse
from torch import Tensor

from vlnhijack.errors import InputError
from vlnhijack.frames import Camera
from vlnhijack.rendering.mitsuba_scene import MitsubaScene, shared_scene
from vlnhijack.rendering.observe import pixel_means
from vlnhijack.rendering.renderer import require_texture
from vlnhijack.rendering.samples import camera_rays, image_size, runs, views_sensor
from vlnhijack.rendering.transport import assemble, transport_rows
from vlnhijack.rendering.variant import activate
from vlnhijack.scenes.house import House


class FrozenRenderer:
    """image = b + A·t over the camera rays of `render_views(house, cameras, spp, seed)`.

    Builds A once (see `transport`); each call and each gradient is one sparse product,
    bit-identical at equal thread count. Raises InputError for a lit house.
    """

    def __init__(
        self,
        house: House,
        object_id: str,
        cameras: Sequence[Camera],
        spp: int = 16,
        seed: int = 0,
    ) -> None:
        if house.kind != "baked":
            raise InputError(
                file=house.name, field="kind", expected="baked, for FrozenRenderer", received="lit"
            )
        self.cameras = tuple(cameras)
        rows, columns, _ = house.surface(object_id).texture.shape
        self.texture_shape = (rows, columns, 3)
        target = next(i for i, s in enumerate(house.surfaces) if s.object_id == object_id)
        built, sensor = shared_scene(house), None
        parts, backgrounds = [], []
        for run in runs(cameras, spp, seed):
            sensor = sensor or views_sensor(run.cameras, spp)
            sensor.aim(run.cameras)
            part, background = _trace(built, target, sensor, run.seed, spp, self.texture_shape)
            parts.append(part)
            backgrounds.append(background)
        width, height = image_size(cameras)
        pixels = len(cameras) * height * width
        parts[-1] = parts[-1][: pixels - sum(part.shape[0] for part in parts[:-1])]
        self.transport = assemble(parts, self.texture_shape)
        self.background = torch.from_numpy(np.concatenate(backgrounds)[:pixels])

    def __call__(self, texture: Tensor) -> Tensor:
        """Images (V,3,h,w) of a texture (H,W,3); InputError for another shape."""
        require_texture(texture, self.texture_shape)
        image = self.background + self.transport(texture)
        width, height = image_size(self.cameras)
        return image.view(-1, height, width, 3).permute(0, 3, 1, 2)


def _trace(
    built: MitsubaScene,
    target: int,
    sensor: Any,
    seed: int,
    spp: int,
    texture_shape: tuple[int, int, int],
) -> tuple[sparse.csr_array, NDArray[np.float32]]:
    """Rows of A, and the radiance (P,3) of everything but the target surface, of one run."""
    mi = activate()
    import drjit as dr

    ray, _ = camera_rays(sensor, seed, spp)
    interaction = built.scene.ray_intersect(ray, mi.RayFlags.All, True)
    on_target = built.surface_index(interaction) == target
    radiance = interaction.emitter(built.scene).eval(interaction, ~on_target)
    hit: Any = dr.compress(on_target & (mi.Frame3f.cos_theta(interaction.wi) > 0))
    uv = [np.array(dr.gather(mi.Float, channel, hit)) for channel in interaction.uv]
    background = pixel_means(radiance, spp)
    rows = transport_rows(
        np.array(hit) // spp, np.stack(uv, 1), 1 / spp, len(background), texture_shape
    )
    return rows, background
