"""Light that reaches points of diffuse surfaces, gathered with Mitsuba's rays.

"Light" is outgoing radiance over albedo, that is irradiance over π. Directions and points on lamps
are an R2 sequence (Roberts 2018) that each point shifts at random (Cranley and Patterson 1976).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vlnhijack.rendering.mitsuba_scene import MitsubaScene
from vlnhijack.rendering.observe import pixel_means
from vlnhijack.rendering.samples import RAYS_AT_ONCE
from vlnhijack.rendering.variant import activate
from vlnhijack.scenes.house import Light

LAMP_SAMPLES = 16
_IN_FRONT = 1.5e-3
_NEAREST = 0.02
_R2 = (0.7548776662466927, 0.5698402909980532)

Floats = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Points:
    """Positions (K,3) in metres and unit normals (K,3)."""

    positions: Floats
    normals: Floats

    def __len__(self) -> int:
        return len(self.positions)

    def __getitem__(self, index: NDArray[np.integer] | slice) -> "Points":
        return Points(self.positions[index], self.normals[index])


def direct_light(
    built: MitsubaScene, lamps: Sequence[Light], points: Points, random: np.random.Generator
) -> Floats:
    """Light (K,3) that K points receive from lamps, which are not part of the scene."""
    light = np.zeros_like(points.positions)
    for lamp in lamps:
        facing = np.flatnonzero(_faces(points, lamp))
        for part in _parts(facing, LAMP_SAMPLES):
            share = _lamp_share(built, lamp, points[part], random.random((len(part), 2)))
            light[part] += share * np.array(lamp.radiance, np.float32)
    return light


def reflected_light(
    built: MitsubaScene, points: Points, spp: int, random: np.random.Generator
) -> tuple[Floats, Floats]:
    """Light (K,3) of the glowing surfaces around K points, and the share (K,) of backs seen."""
    found = []
    for part in _parts(np.arange(len(points)), spp):
        found.append(_gather(built, points[part], spp, random.random((len(part), 2))))
    means = np.concatenate(found)
    return means[:, :3], means[:, 3]


def _parts(index: NDArray[np.int64], spp: int) -> Iterator[NDArray[np.int64]]:
    length = max(1, RAYS_AT_ONCE // spp)
    return (index[first : first + length] for first in range(0, len(index), length))


def _faces(points: Points, lamp: Light) -> NDArray[np.bool_]:
    """Whether any corner of the lamp is above each point's plane, and the point before the lamp."""
    centre, u, v = (np.array(x, np.float32) for x in (lamp.centre, lamp.half_u, lamp.half_v))
    reach = np.abs(points.normals @ u) + np.abs(points.normals @ v)
    offset = centre - points.positions
    above = np.einsum("kd,kd->k", points.normals, offset) + reach > 0
    return above & (offset @ np.cross(u, v) < 0)


def _lamp_share(built: MitsubaScene, lamp: Light, points: Points, shift: Any) -> Floats:
    mi = activate()
    import drjit as dr

    position, normal, sample = _samples(points, LAMP_SAMPLES, shift)
    centre, u, v = (mi.Vector3f(dr.opaque(mi.Float, 0)) + mi.Vector3f(x) for x in _sides(lamp))
    facing = dr.normalize(dr.cross(u, v))
    area = 4 * dr.norm(dr.cross(u, v))
    towards = centre + (2 * sample.x - 1) * u + (2 * sample.y - 1) * v - position
    distance = dr.maximum(dr.norm(towards), _NEAREST)
    direction = towards / distance
    cosines = dr.maximum(dr.dot(normal, direction), 0) * dr.maximum(-dr.dot(facing, direction), 0)
    ray = mi.Ray3f(position, direction)
    ray.maxt = distance * (1 - 1e-3)
    visible = ~built.scene.ray_test(ray, cosines > 0)
    share = dr.select(visible, cosines * area / (dr.pi * dr.square(distance)), 0)
    return pixel_means([share], LAMP_SAMPLES)


def _sides(lamp: Light) -> tuple[tuple[float, float, float], ...]:
    return lamp.centre, lamp.half_u, lamp.half_v


def _gather(built: MitsubaScene, points: Points, spp: int, shift: Any) -> Floats:
    mi = activate()
    import drjit as dr

    position, normal, sample = _samples(points, spp, shift)
    direction = mi.Frame3f(normal).to_world(mi.warp.square_to_cosine_hemisphere(sample))
    seen = built.scene.ray_intersect(mi.Ray3f(position, direction), mi.RayFlags.All, False)
    back = dr.select(seen.is_valid() & (dr.dot(seen.n, direction) > 0), mi.Float(1), 0)
    return pixel_means((*seen.emitter(built.scene).eval(seen), back), spp)


def _samples(points: Points, spp: int, shift: NDArray[np.float64]) -> tuple[Any, Any, Any]:
    """Positions just in front of the points, normals and 2D samples, `spp` after another."""
    mi = activate()
    import drjit as dr

    count = dr.opaque(mi.UInt32, spp)
    index = dr.arange(mi.UInt32, len(points) * spp)
    point = index // count
    number = mi.Float(index - point * count)
    position, normal = (
        dr.gather(mi.Vector3f, mi.Float(x.ravel()), point)
        for x in (points.positions, points.normals)
    )
    sample = dr.gather(mi.Point2f, mi.Float(shift.astype(np.float32).ravel()), point)
    sample += number * mi.Point2f(*_R2)
    return position + _IN_FRONT * normal, normal, sample - dr.floor(sample)
