"""What the camera rays of a renderer meet, run by run."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from vlnhijack.frames import Camera
from vlnhijack.rendering.filters import Film
from vlnhijack.rendering.samples import CameraRays, camera_rays, image_size, runs, views_sensor


class Met(NamedTuple):
    """Of each ray: uv where it meets the object, and what its pixel gets from there.

    light: one Float per channel (one, or RGB) that the object's texel is multiplied by, 0 where the
    ray misses the object; rest: RGB radiance of everything else.
    """

    uv: Any
    light: Sequence[Any]
    rest: Any


@dataclass(frozen=True, eq=False)
class Samples:
    """The rays of a run, in film order with its border; its first `views` views count.

    first: number of the first of their pixels among those of all runs; size: of a view, without
    border; position: where the rays meet the film (see CameraRays).
    """

    first: int
    views: int
    size: tuple[int, int]
    spp: int
    position: Any
    met: Met


def trace(
    cameras: Sequence[Camera],
    spp: int,
    seed: int,
    film: Film,
    meet: Callable[[CameraRays, int], Met],
) -> Iterator[Samples]:
    """Runs of the camera rays of `render_views`; meet maps the rays and the seed of a run."""
    sensor = None
    width, height = image_size(cameras)
    for run in runs(cameras, spp, seed):
        sensor = sensor or views_sensor(run.cameras, spp, film)
        sensor.aim(run.cameras)
        rays = camera_rays(sensor, run.seed, spp)
        first = run.first * width * height
        views = min(len(run.cameras), len(cameras) - run.first)
        met = meet(rays, run.seed)
        yield Samples(first, views, (width, height), spp, rays.position, met)
