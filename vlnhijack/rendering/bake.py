"""Path-traced light baked into textures, as scans carry it.

Diffuse light does not depend on the view: per texel, Mitsuba's path tracer looks at the surface
from a millimetre in front of it. Light varies more slowly than albedo, so it is traced at a lower
resolution, smoothed across coplanar neighbours and multiplied by the albedo.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from vlnhijack import display
from vlnhijack.rendering.mitsuba_scene import MitsubaScene, build_scene
from vlnhijack.rendering.observe import path_tracer, pixel_means
from vlnhijack.rendering.samples import RAYS_AT_ONCE
from vlnhijack.rendering.variant import activate
from vlnhijack.scenes.house import House, Light
from vlnhijack.scenes.surface import Surface
from vlnhijack.scenes.uv_atlas import Texels, dilate, rasterise

BRIGHTNESS = 0.45
_LIGHT_SHRINK = {256: 4, 48: 2}
_IN_FRONT = 1.5e-3
_SMALLEST_ALBEDO = 1e-3

Floats = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class _LightMap:
    """Light (radiance over albedo) of K texels of an (h,w) grid, with their points and normals."""

    shape: tuple[int, int]
    texels: Texels
    points: Floats
    normals: Floats


def bake(lit: House, spp: int = 64, seed: int = 0) -> House:
    """The baked house of a lit one: textures hold encode(clip(exposure · radiance)).

    An exposure of 1 is replaced by the one that gives a mean texel of 0.45; the house that is
    returned carries the exposure used. Lights become bright background surfaces.
    """
    built = build_scene(lit)
    maps = [_light_map(surface, _shrink(surface)) for surface in lit.surfaces]
    points = np.concatenate([m.points for m in maps])
    normals = np.concatenate([m.normals for m in maps])
    light, lit_texels = _trace(built, points, normals, spp, seed)
    ends = np.cumsum([len(m.points) for m in maps])[:-1]
    parts = zip(lit.surfaces, maps, np.split(light, ends), np.split(lit_texels, ends), strict=True)
    radiance = [_radiance(*part) for part in parts]
    exposure = lit.exposure if lit.exposure != 1 else _exposure([r[m] for r, m in radiance])
    surfaces = [
        replace(surface, texture=dilate(display.encode(exposure * values), mask))
        for surface, (values, mask) in zip(lit.surfaces, radiance, strict=True)
    ]
    surfaces += [_lamp(f"light_{i}", lamp, exposure) for i, lamp in enumerate(lit.lights)]
    return replace(lit, kind="baked", surfaces=tuple(surfaces), lights=(), exposure=exposure)


def _shrink(surface: Surface) -> int:
    """Texels per light texel: walls and floors take 4, furniture 2, the smallest textures 1."""
    side = max(surface.texture.shape[:2])
    return next((shrink for above, shrink in _LIGHT_SHRINK.items() if side > above), 1)


def _light_map(surface: Surface, shrink: int) -> _LightMap:
    height, width = (-(-size // shrink) for size in surface.texture.shape[:2])
    texels = rasterise(surface.uv, surface.faces, height, width)
    corners = surface.vertices[surface.faces[texels.face]].astype(np.float64)
    inner = 0.999 * texels.barycentric + 0.001 / 3
    points = np.einsum("kc,kcd->kd", inner, corners)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-20)
    return _LightMap((height, width), texels, points.astype(np.float32), normals.astype(np.float32))


def _trace(
    built: MitsubaScene, points: Floats, normals: Floats, spp: int, seed: int
) -> tuple[Floats, NDArray[np.bool_]]:
    """Light (K,3) at K points, and whether each (K,) lies in the open, not inside a solid."""
    run = min(max(1, RAYS_AT_ONCE // spp), len(points))
    light, is_open = np.zeros_like(points), np.zeros(len(points), bool)
    for first in range(0, len(points), run):
        index = np.minimum(np.arange(first, first + run), len(points) - 1)
        light[index], is_open[index] = _trace_run(
            built, points[index], normals[index], spp, (seed + first) % (1 << 32)
        )
    return light, is_open


def _trace_run(
    built: MitsubaScene, points: Floats, normals: Floats, spp: int, seed: int
) -> tuple[Floats, NDArray[np.bool_]]:
    mi = activate()
    import drjit as dr

    index = dr.arange(mi.UInt32, len(points) * spp) // dr.opaque(mi.UInt32, spp)
    normal = dr.gather(mi.Vector3f, mi.Float(normals.ravel()), index)
    origin = dr.gather(mi.Point3f, mi.Float(points.ravel()), index) + _IN_FRONT * normal
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, len(points) * spp)
    ray = mi.RayDifferential3f(origin, -normal)
    seen = built.scene.ray_intersect(ray, mi.RayFlags.All, True)
    albedo = seen.bsdf().eval_diffuse_reflectance(seen)
    radiance, _, _ = path_tracer().sample(built.scene, sampler, ray)
    outwards = mi.Frame3f(normal).to_world(mi.warp.square_to_cosine_hemisphere(sampler.next_2d()))
    around = built.scene.ray_intersect(mi.Ray3f(origin, outwards))
    inside = around.is_valid() & (dr.dot(around.n, outwards) > 0)
    light = radiance / dr.maximum(albedo, _SMALLEST_ALBEDO)
    means = pixel_means((*light, dr.select(inside, mi.Float(1), 0)), spp)
    return means[:, :3], means[:, 3] < 0.5


def _radiance(
    surface: Surface, coarse: _LightMap, light: Floats, is_open: NDArray[np.bool_]
) -> tuple[Floats, NDArray[np.bool_]]:
    """Radiance (H,W,3) of a texture, and the mask (H,W) of its used texels."""
    shrink = _shrink(surface)
    fine = coarse if shrink == 1 else _light_map(surface, 1)
    usable = is_open if is_open.any() else np.ones_like(is_open)
    smooth = _resample(coarse, light, usable, fine, shrink)
    rows, columns = fine.texels.rows, fine.texels.columns
    radiance = np.zeros_like(surface.texture)
    radiance[rows, columns] = smooth * display.decode(surface.texture[rows, columns])
    mask = np.zeros(surface.texture.shape[:2], bool)
    mask[rows, columns] = True
    return radiance, mask


def _resample(
    coarse: _LightMap,
    light: Floats,
    usable: NDArray[np.bool_],
    fine: _LightMap,
    shrink: int,
) -> Floats:
    """Light (K,3) at the fine texels: a Gaussian over usable coarse texels of the same plane."""
    height, width = coarse.shape
    slot = np.full((height, width), -1, np.int64)
    kept = np.flatnonzero(usable)
    slot[coarse.texels.rows[kept], coarse.texels.columns[kept]] = kept
    row = (fine.texels.rows + 0.5) / shrink - 0.5
    column = (fine.texels.columns + 0.5) / shrink - 0.5
    near_row, near_column = np.rint(row).astype(np.int64), np.rint(column).astype(np.int64)
    total, weights = np.zeros_like(fine.points), np.zeros(len(row), np.float32)
    for offset_row, offset_column in np.ndindex(5, 5):
        r = np.clip(near_row + offset_row - 2, 0, height - 1)
        c = np.clip(near_column + offset_column - 2, 0, width - 1)
        source = slot[r, c]
        weight = np.exp(-0.5 * ((r - row) ** 2 + (c - column) ** 2)).astype(np.float32)
        weight *= (source >= 0) & _same_plane(fine, coarse, source)
        total += weight[:, None] * light[source]
        weights += weight
    missing = weights < 1e-6
    nearest = distance_transform_edt(slot < 0, return_distances=False, return_indices=True)
    r, c = (np.clip(x[missing], 0, n - 1) for x, n in ((near_row, height), (near_column, width)))
    total[missing] = light[slot[nearest[0][r, c], nearest[1][r, c]]]
    weights[missing] = 1
    return total / weights[:, None]


def _same_plane(fine: _LightMap, coarse: _LightMap, source: NDArray[np.int64]) -> NDArray[np.bool_]:
    aligned = np.einsum("kd,kd->k", fine.normals, coarse.normals[source]) > 0.8
    gap = np.einsum("kd,kd->k", fine.normals, coarse.points[source] - fine.points)
    return aligned & (np.abs(gap) < 0.05)


def _exposure(radiance: list[Floats]) -> float:
    """The exposure, by bisection, at which used texels have a mean display value of 0.45."""
    values = np.concatenate([r.reshape(-1, 3) for r in radiance])[::7]
    low, high = 1e-4, 1e4
    for _ in range(30):
        middle = float(np.sqrt(low * high))
        dark = display.encode(middle * values).mean() < BRIGHTNESS
        low, high = (middle, high) if dark else (low, middle)
    return float(np.sqrt(low * high))


def _lamp(name: str, light: Light, exposure: float) -> Surface:
    centre, u, v = (np.asarray(x) for x in (light.centre, light.half_u, light.half_v))
    corners = np.stack([centre - u - v, centre + u - v, centre + u + v, centre - u + v])
    colour = display.encode(np.full((4, 4, 3), exposure * np.array(light.radiance)))
    return Surface(
        name,
        corners.astype(np.float32),
        np.array([[0, 1, 2], [0, 2, 3]], np.int32),
        np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32),
        colour,
    )
