"""What each view shows: object per pixel, distance per pixel, share of the view per object."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vlnhijack.frames import Camera
from vlnhijack.rendering.mitsuba_scene import MitsubaScene, shared_scene
from vlnhijack.rendering.samples import camera_rays, centre_rays, image_size, runs, views_sensor
from vlnhijack.rendering.variant import activate
from vlnhijack.scenes.house import House


def object_coverage(
    house: House, cameras: Sequence[Camera], spp: int = 4, seed: int = 0
) -> NDArray[np.float32]:
    """Share (V, objects) of each view's camera rays that hit the front of each object.

    Of the same rays as `render_views(house, cameras, spp, seed)`.
    """
    count = len(house.objects)
    width, height = image_size(cameras)

    def share(built: MitsubaScene, sensor: Any, run_seed: int) -> NDArray[Any]:
        rays = camera_rays(sensor, run_seed, spp)
        index = _object_index(house, built, rays.ray).reshape(-1, width * height * spp)
        views = len(index)
        bins = index + 1 + np.arange(views)[:, None] * (count + 1)
        hits = np.bincount(bins.ravel(), minlength=views * (count + 1))
        return hits.reshape(views, count + 1)[:, 1:] / index.shape[1]

    return _for_views(house, cameras, spp, seed, share).astype(np.float32)


def object_pixels(house: House, cameras: Sequence[Camera]) -> NDArray[np.int32]:
    """Pixels (V, objects) whose one ray, `object_coverage`'s with spp 1, meets each object."""
    width, height = image_size(cameras)
    share = object_coverage(house, cameras, spp=1).astype(np.float64)
    return np.round(share * (width * height)).astype(np.int32)


def object_index_map(house: House, cameras: Sequence[Camera]) -> NDArray[np.int16]:
    """Index (V,h,w) into `house.objects` of what each pixel's centre shows, -1 for the rest."""

    def index(built: MitsubaScene, sensor: Any, _: int) -> NDArray[Any]:
        return _object_index(house, built, centre_rays(sensor)).astype(np.int16)

    width, height = image_size(cameras)
    return _for_views(house, cameras, 1, 0, index).reshape(-1, height, width)


def depth_map(house: House, cameras: Sequence[Camera]) -> NDArray[np.float32]:
    """Distance (V,h,w) in metres along the ray through each pixel's centre, infinite for none."""

    def distance(built: MitsubaScene, sensor: Any, _: int) -> NDArray[Any]:
        return np.array(built.scene.ray_intersect_preliminary(centre_rays(sensor)).t)

    width, height = image_size(cameras)
    return _for_views(house, cameras, 1, 0, distance).reshape(-1, height, width)


def _for_views(
    house: House,
    cameras: Sequence[Camera],
    spp: int,
    seed: int,
    measure: Callable[[MitsubaScene, Any, int], NDArray[Any]],
) -> NDArray[Any]:
    """Runs of `measure(scene, sensor, seed)`, joined and cut to V views (V, …)."""
    built, sensor, found = shared_scene(house), None, []
    for run in runs(cameras, spp, seed):
        sensor = sensor or views_sensor(run.cameras, spp)
        sensor.aim(run.cameras)
        found.append(measure(built, sensor, run.seed).reshape(len(run.cameras), -1))
    return np.concatenate(found)[: len(cameras)]


def _object_index(house: House, built: MitsubaScene, ray: Any) -> NDArray[np.int32]:
    mi = activate()
    import drjit as dr

    order = {item.id: index for index, item in enumerate(house.objects)}
    table = [order.get(surface.object_id or "", -1) for surface in house.surfaces]
    interaction = built.scene.ray_intersect(ray, mi.RayFlags.All, True)
    surface = built.surface_index(interaction)
    front = (mi.Frame3f.cos_theta(interaction.wi) > 0) & (surface >= 0)
    found = dr.gather(mi.Int32, mi.Int32(table), mi.UInt32(surface), front)
    return np.array(dr.select(front, found, -1))
