"""Mitsuba's own differentiable renderer behind the `Renderer` protocol."""

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor

from vlnhijack.frames import Camera
from vlnhijack.rendering.mitsuba_scene import bitmap_shape, build_scene, texture_key
from vlnhijack.rendering.observe import LIT_DEPTH
from vlnhijack.rendering.renderer import require_texture
from vlnhijack.rendering.samples import image_size, runs, views_sensor
from vlnhijack.rendering.variant import activate
from vlnhijack.scenes.house import House


class MitsubaRenderer:
    """Path replay backpropagation (`prb`) through `dr.wrap`: torch in, torch out.

    max_depth None means emission alone for baked houses and LIT_DEPTH for lit ones. Images use the
    camera rays of `render_views` at `seed`; `seed` may be set between calls. Gradients use other
    rays than images, which keeps them unbiased, namely those of `gradient_seed` if it is set.
    """

    def __init__(
        self,
        house: House,
        object_id: str,
        cameras: Sequence[Camera],
        spp: int = 16,
        seed: int = 0,
        *,
        max_depth: int | None = None,
    ) -> None:
        mi = activate()
        self.cameras = tuple(cameras)
        self.spp, self.seed = spp, seed
        self.gradient_seed: int | None = None
        rows, columns, _ = house.surface(object_id).texture.shape
        self.texture_shape = (rows, columns, 3)
        self._exposure = house.exposure if house.kind == "lit" else None
        depth = max_depth or (1 if house.kind == "baked" else LIT_DEPTH)
        self._integrator = mi.load_dict({"type": "prb", "max_depth": depth})
        self._scene = build_scene(house).scene
        self._sensors = [views_sensor(run.cameras, spp) for run in runs(cameras, spp)]
        key = texture_key(house, object_id)
        self._params = mi.traverse(self._scene)
        self._params.keep([key])
        self._render = _torch_render(self._params, key, self._integrator, self._scene, spp)

    def __call__(self, texture: Tensor) -> Tensor:
        """Images (V,3,h,w) of a texture (H,W,3); InputError for another shape."""
        require_texture(texture, self.texture_shape)
        values = texture if self._exposure is None else _decode(texture)
        values = values.expand(bitmap_shape(self.texture_shape))
        films = [
            self._render(values, sensor, run.seed, self._gradient_seed(run.first))
            for sensor, run in zip(
                self._sensors, runs(self.cameras, self.spp, self.seed), strict=True
            )
        ]
        width, height = image_size(self.cameras)
        images = torch.cat(films).view(-1, height, width, 3)[: len(self.cameras)]
        shown = images if self._exposure is None else _encode(self._exposure * images)
        return shown.permute(0, 3, 1, 2)

    def _gradient_seed(self, first: int) -> int:
        """0 lets Mitsuba derive one from the seed of the images."""
        return 0 if self.gradient_seed is None else (self.gradient_seed + first) % (1 << 32)


def _torch_render(params: Any, key: str, integrator: Any, scene: Any, spp: int) -> Any:
    mi = activate()
    import drjit as dr

    @dr.wrap(source="torch", target="drjit")
    def render(texture: Any, sensor: Any, seed: int, gradient_seed: int) -> Any:
        params[key] = texture
        params.update()
        return mi.render(
            scene,
            params,
            sensor=sensor,
            integrator=integrator,
            spp=spp,
            seed=seed,
            seed_grad=gradient_seed,
        )

    return render


def _decode(display: Tensor) -> Tensor:
    """Linear values of display values (see vlnhijack.display), differentiable."""
    high = ((display.clamp_min(0.04045) + 0.055) / 1.055) ** 2.4
    return torch.where(display <= 0.04045, display / 12.92, high)


def _encode(linear: Tensor) -> Tensor:
    """Display values of linear radiance, clipped to [0,1] (see vlnhijack.display)."""
    x = linear.clamp(0, 1)
    high = 1.055 * x.clamp_min(0.0031308) ** (1 / 2.4) - 0.055
    return torch.where(x <= 0.0031308, 12.92 * x, high)
