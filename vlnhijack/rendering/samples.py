"""Camera rays: the one place that draws them.

Many cameras of one image size are one Mitsuba sensor whose film stacks the views from top to
bottom, so that all of them render in one wavefront. `camera_rays` draws with the `sample_rays` of
Mitsuba's own integrators: `mi.render` with the same sensor, seed and spp uses the same rays.

A film filter wider than a pixel gets a border of pixels around each view, which `cropped` cuts off.
So views do not leak into each other, and a pixel at the edge has samples on all sides.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from math import isqrt
from typing import Any, NamedTuple

import numpy as np

from vlnhijack.errors import InputError
from vlnhijack.frames import Camera, camera_to_world
from vlnhijack.rendering.filters import Film, Filters, film_filter
from vlnhijack.rendering.variant import activate

SAMPLER = "stratified"
RAYS_AT_ONCE = 1 << 22
_FAR = 1e4


def image_size(cameras: Sequence[Camera]) -> tuple[int, int]:
    """Width and height of all cameras; InputError where there is none or they differ."""
    sizes = {(camera.width, camera.height) for camera in cameras}
    if len(sizes) != 1:
        raise InputError(
            field="cameras", expected="one or more of one image size", received=sorted(sizes)
        )
    return sizes.pop()


def border_of(film: Film) -> int:
    """Pixels that the film needs on every side of a view."""
    return int(film_filter(Filters(film)).border_size())


def views_sensor(cameras: Sequence[Camera], spp: int, film: Film = "box") -> Any:
    """A Mitsuba sensor of V cameras: float32 film (V·(height + 2·border), width + 2·border).

    `sensor.aim(cameras)` points it at as many other cameras of the same size. Raises InputError
    where spp is no positive square number, as the stratified sampler needs.
    """
    if spp < 1 or isqrt(spp) ** 2 != spp:
        raise InputError(field="spp", expected="a square number", received=spp)
    width, height = image_size(cameras)
    mi = activate()
    _register()
    border = border_of(film)
    content = {
        "type": "hdrfilm",
        "width": width + 2 * border,
        "height": (height + 2 * border) * len(cameras),
        "rfilter": {"type": film},
        "pixel_format": "rgb",
        "component_format": "float32",
        "sample_border": False,
    }
    sampler = {"type": SAMPLER, "sample_count": spp}
    source = {"type": "vlnhijack_views", "film": content, "sampler": sampler}
    sensor = mi.load_dict(source, parallel=False)
    sensor.aim(cameras)
    return sensor


class CameraRays(NamedTuple):
    """Rays in film order, `spp` after another for each pixel.

    position: where they meet the film, in pixels (box filter: the pixel's corner); sampler: the one
    that drew them.
    """

    ray: Any
    position: Any
    sampler: Any


def camera_rays(sensor: Any, seed: int, spp: int) -> CameraRays:
    """The rays of Mitsuba's AD integrators (mitsuba.ad.integrators.common, ADIntegrator)."""
    integrator = _ray_source()
    sampler, _ = integrator.prepare(sensor, seed, spp)
    ray, _, position = integrator.sample_rays(sensor=sensor, scene=None, sampler=sampler)
    return CameraRays(ray, position, sampler)


def centre_rays(sensor: Any) -> Any:
    """One ray through the centre of each pixel, in film order."""
    mi = activate()
    import drjit as dr

    width, height = sensor.film().size()
    index = dr.arange(mi.UInt32, int(width * height))
    position = mi.Point2f(index % width, index // width) + 0.5
    ray, _ = sensor.sample_ray_differential(0.0, 0.0, position / mi.Point2f(width, height), 0.0)
    return ray


@dataclass(frozen=True)
class Run:
    """A run of cameras that render in one wavefront, from camera number `first` on."""

    first: int
    cameras: list[Camera]
    seed: int


def runs(cameras: Sequence[Camera], spp: int, seed: int = 0) -> Iterator[Run]:
    """Equally long runs of at most RAYS_AT_ONCE rays, each with a seed of its own.

    The last run is filled up with its last camera, so that one compiled kernel serves all. Whoever
    renders the same cameras, spp and seed by these runs uses the same rays.
    """
    width, height = image_size(cameras)
    length = min(max(1, RAYS_AT_ONCE // (width * height * spp)), len(cameras))
    for first in range(0, len(cameras), length):
        run = list(cameras[first : first + length])
        run += [run[-1]] * (length - len(run))
        yield Run(first, run, (seed + first) % (1 << 32))


@cache
def _ray_source() -> Any:
    return activate().load_dict({"type": "prb", "max_depth": 1})


@cache
def _register() -> None:
    mi: Any = activate()
    import drjit as dr

    sensor: Any = mi.Sensor

    class Views(sensor):
        """Pinhole cameras of one size, stacked from top to bottom."""

        def __init__(self, props: Any) -> None:
            super().__init__(props)
            self.m_needs_sample_3 = False

        def aim(self, cameras: Sequence[Camera]) -> None:
            poses = np.stack([camera_to_world(camera)[:3].T for camera in cameras])
            half_pixel = np.array([np.tan(c.vertical_fov / 2) / c.height for c in cameras])
            width, height = self.film().size()
            half_height, half_width = half_pixel * height / len(cameras), half_pixel * width
            self.count = dr.opaque(mi.UInt32, len(cameras))
            self.poses = mi.Float(poses.ravel().astype(np.float32))
            self.half_height = mi.Float(half_height.astype(np.float32))
            self.half_width = mi.Float(half_width.astype(np.float32))

        def sample_ray_differential(
            self, time: Any, sample1: Any, sample2: Any, sample3: Any, active: Any = True
        ) -> tuple[Any, Any]:
            row = sample2.y * mi.Float(self.count)
            view = dr.minimum(mi.UInt32(row), self.count - 1)
            x = (1 - 2 * sample2.x) * dr.gather(mi.Float, self.half_width, view)
            y = (1 - 2 * (row - view)) * dr.gather(mi.Float, self.half_height, view)
            left, up, forward, position = (
                dr.gather(mi.Vector3f, self.poses, 4 * view + axis) for axis in range(4)
            )
            ray = dr.zeros(mi.RayDifferential3f)
            ray.o = mi.Point3f(position)
            ray.d = dr.normalize(x * left + y * up + forward)
            ray.maxt = mi.Float(_FAR)
            ray.time = time
            return ray, mi.Spectrum(1)

        def to_string(self) -> str:
            return f"Views[{self.film().size()}]"

    mi.register_sensor("vlnhijack_views", Views)
