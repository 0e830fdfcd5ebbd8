"""Places from which a piece of furniture fills about half of a view."""

import numpy as np
import trimesh
from numpy.typing import NDArray

from vlnhijack.frames import Camera, camera_to_world, heading_of

FILL = (0.40, 0.65)
BEST_FILL = 0.5
FARTHEST = 1.1
MOST_PLACES = 100
VIEW_STEP = np.pi / 6

Array = NDArray[np.float64]


def lookouts(places: Array, piece: trimesh.Trimesh, rng: np.random.Generator) -> NDArray[np.int64]:
    """Rows (K,) of places (P,3), metres, where the piece fills 40-65 % of one of the 36 views.

    At most 100 places near the piece are looked at; those nearest to 50 % come first. Whatever may
    stand between the place and the piece is left out.
    """
    low, high = piece.bounds
    apart = np.maximum(np.maximum(low - places, places - high), 0)[:, :2]
    near = np.flatnonzero(np.linalg.norm(apart, axis=1) < FARTHEST)
    near = rng.permutation(near)[:MOST_PLACES]
    fill = np.array([_fill(places[row], piece) for row in near])
    kept = (fill >= FILL[0]) & (fill <= FILL[1]) if len(near) else np.zeros(0, bool)
    return near[kept][np.argsort(np.abs(fill[kept] - BEST_FILL), kind="stable")]


def _fill(place: Array, piece: trimesh.Trimesh) -> float:
    """The largest share of a 75°×60° view that the piece fills, of the two views towards it."""
    heading = VIEW_STEP * np.round(heading_of(piece.centroid - place) / VIEW_STEP)
    x, y, z = map(float, place)
    shares = []
    for elevation in (-VIEW_STEP, 0.0):
        pose = camera_to_world(Camera((x, y, z), float(heading), elevation, 4, 3))
        directions = _RAYS @ pose[:3, :3].T
        hits = piece.ray.intersects_any(np.broadcast_to(place, directions.shape), directions)
        shares.append(float(hits.mean()))
    return max(shares)


def _view_rays(columns: int = 20, rows: int = 15) -> Array:
    """Directions (R,3) through a grid of pixels of a 60° high, 4:3 view, in camera space."""
    u, v = np.meshgrid((np.arange(columns) + 0.5) / columns, (np.arange(rows) + 0.5) / rows)
    half = np.tan(np.pi / 6)
    rays = np.stack([(2 * u - 1) * half * 4 / 3, (1 - 2 * v) * half, np.ones_like(u)], axis=-1)
    rays = rays.reshape(-1, 3)
    return rays / np.linalg.norm(rays, axis=1, keepdims=True)


_RAYS = _view_rays()
