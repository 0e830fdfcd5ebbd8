"""Objects of one mesh carried over to the faces of another that covers the same surfaces."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

REACH = 0.1  # metres between a face and the segmentation, at most
_SPACING = 0.1  # metres between the points that stand for a large face
_MOST_SPLITS = 64
_TURN = 0.02  # metres that a face turned round counts as further away, halved
_NEIGHBOURS = 8
_DIGITS = 5  # of metres: what lies nearer together is equally far
_CHUNK = 1 << 15


@dataclass(frozen=True)
class MatchQuality:
    """How well the faces meet the segmentation.

    within_reach: share of the faces that are at most REACH from it; median and high: that distance
    of half and of 95 % of the faces, metres.
    """

    within_reach: float
    median: float
    high: float


def match_objects(
    segmented: Floats, object_of: Ints, faces: Floats, advance: Callable[[int], None]
) -> tuple[Ints, MatchQuality]:
    """The object (F,) of each of `faces` (F,3,3), -1 for none, from `segmented` (G,3,3) with (G,).

    It is that of the nearest segmented face among the eight whose points are nearest to the face's
    centroid; faces that look the other way count as 4 cm further away, and of equally near ones
    it is the one with the nearest point. advance is told of every run of faces.
    """
    points, owner = _points(segmented)
    tree = cKDTree(points)
    distance, found = np.empty(len(faces)), np.empty(len(faces), np.int64)
    for start in range(0, len(faces), _CHUNK):
        part = slice(start, start + _CHUNK)
        _, near = tree.query(faces[part].mean(1), min(_NEIGHBOURS, len(points)))
        near = owner[near.reshape(len(faces[part]), -1)]
        distance[part], found[part] = _nearest(segmented, near, faces[part])
        advance(len(near))
    quality = MatchQuality(
        float((distance <= REACH).mean()),
        float(np.median(distance)),
        float(np.quantile(distance, 0.95)),
    )
    return np.where(distance <= REACH, object_of[found], -1).astype(np.int32), quality


def _points(corners: Floats) -> tuple[Floats, NDArray[np.int64]]:
    """Points (P,3) on faces (G,3,3), _SPACING apart and at their centroids, and their face (P,)."""
    longest = np.linalg.norm(corners - np.roll(corners, 1, 1), axis=2).max(1)
    splits = np.clip(np.ceil(longest / _SPACING), 1, _MOST_SPLITS).astype(np.int64)
    points, owner = [corners.mean(1)], [np.arange(len(corners))]
    for count in np.unique(splits[splits > 1]):
        members = np.flatnonzero(splits == count)
        i, j = np.indices((count, count))
        inside = i + j < count
        weights = np.stack([i[inside], j[inside], count - 1 - i[inside] - j[inside]], 1) + 1 / 3
        points.append(np.einsum("wc,gcd->gwd", weights / count, corners[members]).reshape(-1, 3))
        owner.append(np.repeat(members, len(weights)))
    return np.concatenate(points), np.concatenate(owner)


def _nearest(segmented: Floats, near: NDArray[np.int64], faces: Floats) -> tuple[Floats, Ints]:
    """Distance (F,) to the best of the candidates (F,K), and which face that is."""
    candidates = segmented[near.ravel()]
    centres = np.repeat(faces.mean(1), near.shape[1], 0)
    closest = trimesh.triangles.closest_point(candidates, centres)
    distance = np.linalg.norm(closest - centres, axis=1).reshape(near.shape)
    distance = np.nan_to_num(distance, nan=np.inf)
    cosine = np.einsum("fkd,fd->fk", _normals(candidates).reshape(*near.shape, 3), _normals(faces))
    best = np.argmin(np.round(distance + _TURN * (1 - cosine), _DIGITS), 1)
    rows = np.arange(len(near))
    return distance[rows, best], near[rows, best]


def _normals(corners: Floats) -> Floats:
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
