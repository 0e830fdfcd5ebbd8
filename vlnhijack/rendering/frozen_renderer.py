"""The exact picture of a baked house for one frozen choice of camera rays."""

from collections.abc import Sequence
from pathlib import Path

from torch import Tensor

from vlnhijack.errors import InputError
from vlnhijack.frames import Camera
from vlnhijack.rendering.entries import MAX_MEMORY
from vlnhijack.rendering.filters import Filters
from vlnhijack.rendering.mitsuba_scene import MitsubaScene, shared_scene, surface_number
from vlnhijack.rendering.renderer import require_texture
from vlnhijack.rendering.samples import CameraRays, image_size
from vlnhijack.rendering.trace import Met, trace
from vlnhijack.rendering.transport import Transport, build
from vlnhijack.rendering.transport_file import fingerprint, load_transport, save_transport
from vlnhijack.rendering.variant import activate
from vlnhijack.scenes.house import House


class FrozenRenderer:
    """image = b + A·t over the camera rays of `render_views(house, cameras, spp, seed)`.

    Builds A once (see `transport`); each call and each gradient is one sparse product,
    bit-identical at equal thread count. max_memory bounds, in megabytes, what building takes beyond
    the rays of a run and the operator itself. A and b are read from `file` where it exists, else
    written there. Raises InputError for a lit house, and for a file of other rays.
    """

    def __init__(
        self,
        house: House,
        object_id: str,
        cameras: Sequence[Camera],
        spp: int = 16,
        seed: int = 0,
        *,
        filters: Filters = Filters(),
        max_memory: float = MAX_MEMORY,
        file: Path | None = None,
    ) -> None:
        if house.kind != "baked":
            raise InputError(
                file=house.name, field="kind", expected="baked, for FrozenRenderer", received="lit"
            )
        self.cameras = tuple(cameras)
        rows, columns, _ = house.surface(object_id).texture.shape
        self.texture_shape = (rows, columns, 3)

        def built() -> tuple[Transport, Tensor]:
            scene, target = shared_scene(house, filters), surface_number(house, object_id)
            traced = trace(
                self.cameras, spp, seed, filters.film, lambda rays, _: _meet(scene, target, rays)
            )
            return build(traced, self.texture_shape, filters, max_memory)

        if file is None:
            self.transport, self.background = built()
            return
        key = fingerprint(house, object_id, self.cameras, spp, seed, filters)
        if not file.exists():
            save_transport(file, key, *built())
        self.transport, self.background = load_transport(file, key)

    def __call__(self, texture: Tensor) -> Tensor:
        """Images (V,3,h,w) of a texture (H,W,3); InputError for another shape."""
        require_texture(texture, self.texture_shape)
        image = self.background + self.transport(texture.to(self.background.device))
        width, height = image_size(self.cameras)
        return image.view(-1, height, width, 3).permute(0, 3, 1, 2).to(texture.device)


def _meet(built: MitsubaScene, target: int, rays: CameraRays) -> Met:
    mi = activate()
    import drjit as dr

    interaction = built.scene.ray_intersect(rays.ray, mi.RayFlags.All, True)
    on_target = built.surface_index(interaction) == target
    rest = interaction.emitter(built.scene).eval(interaction, ~on_target)
    seen = on_target & (mi.Frame3f.cos_theta(interaction.wi) > 0)
    light = dr.select(seen, mi.Float(1), 0)
    dr.eval(interaction.uv, light, rest, rays.position)
    return Met(interaction.uv, [light], rest)
