"""Mitsuba's own differentiable renderer behind the `Renderer` protocol."""

from collections.abc import Mapping, Sequence
from typing import Any

import torch
from torch import Tensor

from vlnhijack.frames import Camera
from vlnhijack.rendering.display_transform import decode, encode
from vlnhijack.rendering.filters import Filters
from vlnhijack.rendering.mitsuba_scene import bitmap_shape, build_scene, texture_key
from vlnhijack.rendering.observe import LIT_DEPTH
from vlnhijack.rendering.renderer import require_texture
from vlnhijack.rendering.samples import border_of, image_size, runs, views_sensor
from vlnhijack.rendering.variant import activate, torch_device
from vlnhijack.scenes.house import House


class MitsubaRenderer:
    """A differentiable integrator of Mitsuba through `dr.wrap`: torch in, torch out.

    integrator is a Mitsuba plugin's dictionary; None means `prb` (path replay backpropagation) of
    max_depth, by default 1 (emission alone) for baked houses and LIT_DEPTH for lit ones. Images use
    the camera rays of `render_views` at `seed`; `seed` may be set between calls. Gradients use
    other rays than images, which keeps them unbiased, namely those of `gradient_seed` if it is set.
    Scene, sensors and films are built once.
    """

    def __init__(
        self,
        house: House,
        object_id: str,
        cameras: Sequence[Camera],
        spp: int = 16,
        seed: int = 0,
        *,
        integrator: Mapping[str, Any] | None = None,
        max_depth: int | None = None,
        filters: Filters = Filters(),
    ) -> None:
        mi = activate()
        self.cameras = tuple(cameras)
        self.spp, self.seed = spp, seed
        self.gradient_seed: int | None = None
        rows, columns, _ = house.surface(object_id).texture.shape
        self.texture_shape = (rows, columns, 3)
        self._exposure = house.exposure if house.kind == "lit" else None
        depth = max_depth or (1 if house.kind == "baked" else LIT_DEPTH)
        self._integrator = mi.load_dict({**(integrator or {"type": "prb", "max_depth": depth})})
        self._scene = build_scene(house, filters).scene
        self._border = border_of(filters.film)
        self._sensors = [views_sensor(run.cameras, spp, filters.film) for run in runs(cameras, spp)]
        key = texture_key(house, object_id)
        self._params = mi.traverse(self._scene)
        self._params.keep([key])
        self._render = _torch_render(self._params, key, self._integrator, self._scene, spp)

    def __call__(self, texture: Tensor) -> Tensor:
        """Images (V,3,h,w) of a texture (H,W,3); InputError for another shape."""
        require_texture(texture, self.texture_shape)
        values = texture.to(torch_device())
        values = values if self._exposure is None else decode(values)
        values = values.expand(bitmap_shape(self.texture_shape))
        films = [
            self._render(values, sensor, run.seed, self._gradient_seed(run.first))
            for sensor, run in zip(
                self._sensors, runs(self.cameras, self.spp, self.seed), strict=True
            )
        ]
        images = self._cropped(torch.cat(films))
        shown = images if self._exposure is None else encode(self._exposure * images)
        return shown.permute(0, 3, 1, 2).to(texture.device)

    def _cropped(self, film: Tensor) -> Tensor:
        """Views (V,h,w,3) of stacked films, without the films' borders and the runs' filling."""
        width, height = image_size(self.cameras)
        border = self._border
        views = film.view(-1, height + 2 * border, width + 2 * border, 3)[: len(self.cameras)]
        return views[:, border : border + height, border : border + width]

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
