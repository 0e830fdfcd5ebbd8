"""The slow twin of the renderers of baked houses: float64, every ray against every triangle.

It takes camera rays from `samples` and shares nothing else with what it checks.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vlnhijack.frames import Camera
from vlnhijack.rendering.samples import camera_rays, views_sensor
from vlnhijack.scenes.house import House

Floats = NDArray[np.float64]


class Hits(NamedTuple):
    """Where N camera rays, `spp` after another for each pixel, meet a surface first.

    surface (N,) index, -1 for none; distance (N,) metres, infinite for none; cosine (N,) between
    the normal and the way back to the camera, positive in front of a face; uv (N,2); layers (N,)
    faces within a micrometre of the first.
    """

    surface: NDArray[np.int64]
    distance: Floats
    cosine: Floats
    uv: Floats
    layers: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Twin:
    """Images and gradients for the camera rays of `render_views(house, cameras, spp, seed)`."""

    house: House
    object_id: str
    cameras: Sequence[Camera]
    spp: int
    seed: int

    @cached_property
    def hits(self) -> Hits:
        return trace(self.house, self.cameras, self.spp, self.seed)

    @cached_property
    def seen(self) -> NDArray[np.bool_]:
        """Which rays (N,) meet the object's front."""
        return self._front([s.object_id for s in self.house.surfaces].index(self.object_id))

    def image(self, texture: Floats) -> Floats:
        """Images (V,3,h,w) with a texture (H,W,3) on the object."""
        radiance = np.zeros((len(self.hits.uv), 3))
        for index, surface in enumerate(self.house.surfaces):
            seen = self._front(index)
            shown = texture if surface.object_id == self.object_id else surface.texture
            texels, weights = _lookup(self.hits.uv[seen], *shown.shape[:2])
            radiance[seen] = np.einsum("nk,nkc->nc", weights, shown.reshape(-1, 3)[texels])
        return self.per_view(radiance).mean(3).transpose(0, 3, 1, 2)

    def gradient(self, weights: Floats) -> Floats:
        """Gradient (H,W,3) of the sum of weights (V,3,h,w) · images."""
        height, width, _ = self.house.surface(self.object_id).texture.shape
        texels, shares = _lookup(self.hits.uv[self.seen], height, width)
        pixel = np.flatnonzero(self.seen) // self.spp
        shown = weights.transpose(0, 2, 3, 1).reshape(-1, 1, 3)[pixel] / self.spp
        gradient = np.zeros((height * width, 3))
        np.add.at(gradient, texels, shares[:, :, None] * shown)
        return gradient.reshape(height, width, 3)

    def per_view(self, rays: NDArray[Any]) -> NDArray[Any]:
        """What was found for every ray (N,…) as (V,h,w,spp,…)."""
        camera = self.cameras[0]
        return rays.reshape(-1, camera.height, camera.width, self.spp, *rays.shape[1:])

    def _front(self, index: int) -> NDArray[np.bool_]:
        return (self.hits.surface == index) & (self.hits.cosine > 0)


def trace(house: House, cameras: Sequence[Camera], spp: int, seed: int) -> Hits:
    """First hits of the rays that `render_views` draws in one wavefront, by Möller–Trumbore."""
    ray = camera_rays(views_sensor(cameras, spp), seed, spp).ray
    origin, direction = (np.array(x, np.float64).T for x in (ray.o, ray.d))
    corners = np.concatenate([s.vertices[s.faces] for s in house.surfaces]).astype(np.float64)
    uv = np.concatenate([s.uv[s.faces] for s in house.surfaces]).astype(np.float64)
    surface = np.repeat(np.arange(len(house.surfaces)), [len(s.faces) for s in house.surfaces])
    distance, inner = _meet(origin, direction, corners)
    face, rays = distance.argmin(1), np.arange(len(origin))
    found = distance[rays, face]
    b, c = inner[rays, face].T
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[face]
    cosine = -(normal * direction).sum(1) / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)
    return Hits(
        np.where(np.isfinite(found), surface[face], -1),
        found,
        cosine,
        np.einsum("nk,nkc->nc", np.stack([1 - b - c, b, c], 1), uv[face]),
        (distance <= np.where(np.isfinite(found), found + 1e-6, -1)[:, None]).sum(1),
    )


def _meet(origin: Floats, direction: Floats, corners: Floats) -> tuple[Floats, Floats]:
    """Distances (N,F) along rays to triangles (F,3,3), and the barycentrics (N,F,2) there."""
    first, edge_b, edge_c = corners[:, 0], *(corners[:, k] - corners[:, 0] for k in (1, 2))
    offset = origin[:, None] - first
    p, q = np.cross(direction[:, None], edge_c), np.cross(offset, edge_b)
    determinant = (p * edge_b).sum(2)
    scale = 1 / np.where(determinant == 0, np.inf, determinant)
    b, c = (offset * p).sum(2) * scale, (direction[:, None] * q).sum(2) * scale
    along = (edge_c * q).sum(2) * scale
    hit = (determinant != 0) & (b >= 0) & (c >= 0) & (b + c <= 1) & (along > 0)
    return np.where(hit, along, np.inf), np.stack([b, c], 2)


def _lookup(uv: Floats, height: int, width: int) -> tuple[NDArray[np.int64], Floats]:
    """Texels (N,4) and weights (N,4) of bilinear lookups at uv (N,2), clamped at the border."""
    column, row = uv[:, 0] * width - 0.5, uv[:, 1] * height - 0.5
    texels, weights = [], []
    for down in (0, 1):
        for right in (0, 1):
            x, y = np.floor(column) + right, np.floor(row) + down
            texels.append(np.clip(y, 0, height - 1) * width + np.clip(x, 0, width - 1))
            weights.append((1 - abs(column - x)) * (1 - abs(row - y)))
    return np.stack(texels, 1).astype(np.int64), np.stack(weights, 1)
