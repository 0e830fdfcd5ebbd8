"""Light baked into textures, as scans carry it.

Diffuse light does not depend on the view, so it is gathered once per texel with Mitsuba's rays:
shadow rays to every lamp, then rounds of cosine-distributed rays that pick up what the surfaces
reflect so far, one bounce a round. Light varies more slowly than albedo, so it is gathered at half
the resolution, smoothed across coplanar neighbours and multiplied by the albedo.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from vlnhijack import display, seeds
from vlnhijack.rendering.gather import Points, direct_light, reflected_light
from vlnhijack.rendering.mitsuba_scene import build_scene, set_textures
from vlnhijack.scenes.house import House, Light
from vlnhijack.scenes.surface import Surface
from vlnhijack.scenes.uv_atlas import Texels, dilate, rasterise

BRIGHTNESS = 0.45
BOUNCES = 5
LARGE = 48

Floats = NDArray[np.float32]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class _Grid:
    """The K texels of an (h,w) grid that a surface uses, and the points they stand for."""

    shape: tuple[int, int]
    texels: Texels
    points: Points


def bake(lit: House, spp: int = 64, seed: int = 0) -> House:
    """The baked house of a lit one: textures hold encode(clip(exposure · radiance)).

    spp rays per texel gather the last bounce. An exposure of 1 is replaced by the one that gives a
    mean texel of 0.45; the house that is returned carries the exposure used. Lamps become bright
    background surfaces. Surfaces need a texture of their own without overlapping uv.
    """
    grids = [_grid(surface, _shrink(surface)) for surface in lit.surfaces]
    light, is_open = _solve(lit, grids, spp, seed)
    parts = zip(lit.surfaces, grids, light, is_open, strict=True)
    radiance = [_radiance(*part) for part in parts]
    exposure = lit.exposure if lit.exposure != 1 else _exposure([r[m] for r, m in radiance])
    surfaces = [
        replace(surface, texture=dilate(display.encode(exposure * values), mask))
        for surface, (values, mask) in zip(lit.surfaces, radiance, strict=True)
    ]
    surfaces += [_lamp(f"light_{i}", lamp, exposure) for i, lamp in enumerate(lit.lights)]
    return replace(lit, kind="baked", surfaces=tuple(surfaces), lights=(), exposure=exposure)


def _solve(lit: House, grids: list[_Grid], spp: int, seed: int) -> tuple[list[Floats], list[Mask]]:
    """Light (K,3) of each grid's texels, and which of them (K,) lie in the open, not in solids."""
    albedo = [_albedo(*part) for part in zip(lit.surfaces, grids, strict=True)]
    coarse = zip(lit.surfaces, grids, strict=True)
    dark = tuple(replace(s, texture=np.zeros((*g.shape, 3), np.float32)) for s, g in coarse)
    built = build_scene(replace(lit, kind="baked", surfaces=dark))
    points = Points(
        np.concatenate([grid.points.positions for grid in grids]),
        np.concatenate([grid.points.normals for grid in grids]),
    )
    ends = np.cumsum([len(grid.points) for grid in grids])[:-1]
    direct = direct_light(built, lit.lights, points, seeds.stream(seed, "bake", "direct"))
    light, backs = direct, np.zeros(len(points), np.float32)
    for bounce in range(BOUNCES):
        glow = [_fill(*part) for part in zip(grids, np.split(light, ends), albedo, strict=True)]
        set_textures(built, glow)
        rays = spp if bounce == BOUNCES - 1 else max(spp // 4, 1)
        random = seeds.stream(seed, "bake", "bounce", bounce)
        reflected, backs = reflected_light(built, points, rays, random)
        light = direct + reflected
    return np.split(light, ends), np.split(backs < 0.5, ends)


def _albedo(surface: Surface, grid: _Grid) -> Floats:
    """Linear albedo (K,3) of the grid's texels: the mean of the texture's that they cover."""
    shrink = _shrink(surface)
    rows, columns = (-size % shrink for size in surface.texture.shape[:2])
    padded = np.pad(display.decode(surface.texture), ((0, rows), (0, columns), (0, 0)), "edge")
    means = padded.reshape(grid.shape[0], shrink, grid.shape[1], shrink, 3).mean((1, 3))
    return np.asarray(means[grid.texels.rows, grid.texels.columns], np.float32)


def _fill(grid: _Grid, light: Floats, albedo: Floats) -> Floats:
    """The radiance texture (h,w,3) of a grid's light."""
    texture = np.zeros((*grid.shape, 3), np.float32)
    texture[grid.texels.rows, grid.texels.columns] = light * albedo
    return texture


def _shrink(surface: Surface) -> int:
    return 2 if max(surface.texture.shape[:2]) > LARGE else 1


def _grid(surface: Surface, shrink: int) -> _Grid:
    height, width = (-(-size // shrink) for size in surface.texture.shape[:2])
    texels = rasterise(surface.uv, surface.faces, height, width)
    corners = surface.vertices[surface.faces[texels.face]].astype(np.float64)
    inner = 0.999 * texels.barycentric + 0.001 / 3
    points = np.einsum("kc,kcd->kd", inner, corners)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-20)
    found = Points(points.astype(np.float32), normals.astype(np.float32))
    return _Grid((height, width), texels, found)


def _radiance(
    surface: Surface, coarse: _Grid, light: Floats, is_open: NDArray[np.bool_]
) -> tuple[Floats, NDArray[np.bool_]]:
    """Radiance (H,W,3) of a texture, and the mask (H,W) of its used texels."""
    shrink = _shrink(surface)
    fine = coarse if shrink == 1 else _grid(surface, 1)
    usable = is_open if is_open.any() else np.ones_like(is_open)
    smooth = _resample(coarse, light, usable, fine, shrink)
    rows, columns = fine.texels.rows, fine.texels.columns
    radiance = np.zeros_like(surface.texture)
    radiance[rows, columns] = smooth * display.decode(surface.texture[rows, columns])
    mask = np.zeros(surface.texture.shape[:2], bool)
    mask[rows, columns] = True
    return radiance, mask


def _resample(
    coarse: _Grid,
    light: Floats,
    usable: NDArray[np.bool_],
    fine: _Grid,
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
    total, weights = np.zeros_like(fine.points.positions), np.zeros(len(row), np.float32)
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


def _same_plane(fine: _Grid, coarse: _Grid, source: NDArray[np.int64]) -> NDArray[np.bool_]:
    aligned = np.einsum("kd,kd->k", fine.points.normals, coarse.points.normals[source]) > 0.8
    gap = np.einsum(
        "kd,kd->k",
        fine.points.normals,
        coarse.points.positions[source] - fine.points.positions,
    )
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
