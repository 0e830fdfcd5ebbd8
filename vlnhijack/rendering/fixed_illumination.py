"""A lit house whose light stands still: image = E(clip(exposure · (b + W·A·D(t)))) (design, 5)."""

from collections.abc import Sequence
from typing import Any

from torch import Tensor

from vlnhijack import display, seeds
from vlnhijack.errors import InputError
from vlnhijack.frames import Camera
from vlnhijack.rendering.display_transform import decode, encode
from vlnhijack.rendering.entries import MAX_MEMORY
from vlnhijack.rendering.filters import Filters
from vlnhijack.rendering.light import light_at
from vlnhijack.rendering.mitsuba_scene import MitsubaScene, build_scene, set_texture, surface_number
from vlnhijack.rendering.observe import path_tracer
from vlnhijack.rendering.renderer import require_texture
from vlnhijack.rendering.samples import CameraRays, image_size
from vlnhijack.rendering.trace import Met, trace
from vlnhijack.rendering.transport import build
from vlnhijack.rendering.variant import activate
from vlnhijack.scenes.house import House


class FixedIlluminationRenderer:
    """The frozen operator of a lit house, at the camera rays of `render_views` with that seed.

    Each ray that meets the object carries RGB weights: the light that falls on that point, by
    `light_spp` paths as deep as those of `render_views`. The weights belong to one texture, at
    first the house's, until `refresh`. The gradient leaves out what the object's light does to
    itself and to the rest, so it is biased. Raises InputError for a baked house.
    """

    def __init__(
        self,
        house: House,
        object_id: str,
        cameras: Sequence[Camera],
        spp: int = 16,
        seed: int = 0,
        *,
        light_spp: int = 4,
        max_memory: float = MAX_MEMORY,
    ) -> None:
        if house.kind != "lit":
            raise InputError(
                file=house.name,
                field="kind",
                expected="lit, for FixedIlluminationRenderer",
                received=house.kind,
            )
        self.cameras = tuple(cameras)
        rows, columns, _ = house.surface(object_id).texture.shape
        self.texture_shape = (rows, columns, 3)
        self._house, self._object_id = house, object_id
        self._spp, self._seed, self._light_spp = spp, seed, light_spp
        self._max_memory = max_memory
        self._scene = build_scene(house)
        self._build()

    def __call__(self, texture: Tensor) -> Tensor:
        """Images (V,3,h,w) of a texture (H,W,3); InputError for another shape."""
        require_texture(texture, self.texture_shape)
        albedo = decode(texture.to(self.background.device))
        shown = encode(self._house.exposure * (self.background + self.transport(albedo)))
        width, height = image_size(self.cameras)
        return shown.view(-1, height, width, 3).permute(0, 3, 1, 2).to(texture.device)

    def refresh(self, texture: Tensor) -> None:
        """Renew weights and background: from now on the light is that around this texture.

        At the same rays and paths, so refreshing twice with one texture changes nothing.
        """
        require_texture(texture, self.texture_shape)
        albedo = display.decode(texture.detach().cpu().numpy())
        set_texture(self._scene, self._house, self._object_id, albedo)
        self._build()

    def _build(self) -> None:
        target = surface_number(self._house, self._object_id)

        def meet(rays: CameraRays, seed: int) -> Met:
            return _meet(self._scene, target, rays, self._light_spp, seeds.integer(seed, "light"))

        traced = trace(self.cameras, self._spp, self._seed, "box", meet)
        self.transport, self.background = build(
            traced, self.texture_shape, Filters(), self._max_memory
        )


def _meet(built: MitsubaScene, target: int, rays: CameraRays, light_spp: int, seed: int) -> Met:
    mi = activate()
    import drjit as dr

    interaction = built.scene.ray_intersect(rays.ray, mi.RayFlags.All, True)
    seen = built.surface_index(interaction) == target
    seen &= mi.Frame3f.cos_theta(interaction.wi) > 0
    rest, _, _ = path_tracer().sample(built.scene, rays.sampler, rays.ray, active=~seen)
    rest = dr.select(seen, 0, rest)
    hit: Any = dr.compress(seen)
    points = dr.gather(mi.SurfaceInteraction3f, interaction, hit)
    dr.eval(rest, points, interaction.uv)
    arriving = light_at(built.scene, points, light_spp, seed)
    light = [dr.zeros(mi.Float, dr.width(seen)) for _ in range(3)]
    for channel, values in zip(light, arriving, strict=True):
        dr.scatter(channel, values, hit)
    return Met(interaction.uv, light, rest)
