"""Light that arrives at points of a lit scene, path traced.

"Light" is outgoing radiance over albedo, that is irradiance over π, as in `gather`.
"""

from typing import Any

import numpy as np

from vlnhijack.rendering.observe import LIT_DEPTH, path_tracer, pixel_means
from vlnhijack.rendering.samples import RAYS_AT_ONCE
from vlnhijack.rendering.variant import activate


def light_at(scene: Any, points: Any, spp: int, seed: int) -> Any:
    """Light (RGB, K) at K surface interactions of a diffuse surface, by `spp` paths each.

    The albedo times this light is, in the mean, what `path_tracer` finds: a shadow ray to a lamp,
    and a cosine-distributed ray that gathers everything but lamps.
    """
    mi = activate()
    import drjit as dr

    count, length = dr.width(points), max(1, RAYS_AT_ONCE // spp)
    parts = []
    for first in range(0, count, length):
        index = dr.arange(mi.UInt32, (min(count, first + length) - first) * spp)
        point = index // dr.opaque(mi.UInt32, spp) + dr.opaque(mi.UInt32, first)
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed((seed + first) % (1 << 32), len(index))
        found = _arriving(scene, dr.gather(type(points), points, point), sampler)
        parts.append(pixel_means(found, spp))
    return mi.Color3f(np.concatenate(parts).T) if parts else mi.Color3f()


def _arriving(scene: Any, points: Any, sampler: Any) -> Any:
    mi = activate()
    import drjit as dr

    lamp, direct = scene.sample_emitter_direction(points, sampler.next_2d(), True)
    cosine = mi.Frame3f.cos_theta(points.to_local(lamp.d))
    direct *= dr.maximum(cosine, 0) / dr.pi
    bounce = mi.warp.square_to_cosine_hemisphere(sampler.next_2d())
    ray = points.spawn_ray(points.to_world(bounce))
    seen = scene.ray_intersect(ray)
    radiance, _, _ = path_tracer(LIT_DEPTH - 1).sample(scene, sampler, mi.RayDifferential3f(ray))
    return dr.maximum(direct + radiance - seen.emitter(scene).eval(seen), 0)
