"""UV atlases: unwrap a mesh with xatlas, and find the texels that its faces use.

Texel positions are u·W − ½ and v·H − ½, as in a bilinear lookup: texel (row, column) weighs on a
point (x, y) when |x − column| < 1 and |y − row| < 1.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import xatlas
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from vlnhijack.errors import InputError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Pairs = tuple[Ints, Ints, Ints]

_PAIRS_AT_ONCE = 1 << 19
_TOUCH = 1e-3
_LARGEST_SHRINK_STEPS = 60


@dataclass(frozen=True, eq=False)
class Atlas:
    """An unwrapped mesh: faces (F,3) int32 into M atlas vertices with uv (M,2) float32.

    source (M,) int32 is the original vertex of each atlas vertex; width, height in texels.
    """

    source: NDArray[np.int32]
    faces: NDArray[np.int32]
    uv: NDArray[np.float32]
    width: int
    height: int


@dataclass(frozen=True, eq=False)
class Texels:
    """K texels that faces use, each once, owned by the nearest face.

    rows, columns, face (K,) int64; barycentric (K,3) float64 of the point of that face that is
    nearest to the texel's centre.
    """

    rows: Ints
    columns: Ints
    face: Ints
    barycentric: Floats


def unwrap(
    vertices: NDArray[np.floating], faces: NDArray[np.integer], resolution: int, padding: int = 2
) -> Atlas:
    """Unwrap vertices (N,3), faces (F,3) into one square atlas of `resolution` texels a side.

    No faces overlap, and charts lie so far apart (`padding` texels and the bilinear footprint) that
    no texel weighs on two of them. Deterministic. Raises InputError where the charts do not fit.
    """
    atlas = xatlas.Atlas()
    atlas.add_mesh(np.ascontiguousarray(vertices, np.float32), faces.astype(np.uint32))
    options = xatlas.PackOptions()
    options.padding, options.bilinear, options.resolution = padding, True, resolution
    options.rotate_charts_to_axis = options.rotate_charts = True
    atlas.generate(pack_options=options)
    scale = atlas.texels_per_unit * resolution / max(atlas.width, atlas.height)
    options.resolution = 0
    for step in range(_LARGEST_SHRINK_STEPS):
        options.texels_per_unit = scale * 0.97**step
        atlas.generate(pack_options=options)
        if max(atlas.width, atlas.height) <= resolution:
            return _atlas(atlas, resolution)
    raise InputError(
        "too many charts for the texture",
        field="resolution",
        expected="a larger texture, or fewer and smoother faces",
        received=f"{resolution} texels for {len(faces)} faces",
    )


def _atlas(atlas: xatlas.Atlas, resolution: int) -> Atlas:
    source, faces, uv = atlas.get_mesh(0)
    scale = np.array([atlas.width, atlas.height]) / resolution
    return Atlas(
        source.astype(np.int32),
        faces.astype(np.int32),
        (uv * scale).astype(np.float32),
        resolution,
        resolution,
    )


def rasterise(
    uv: NDArray[np.floating], faces: NDArray[np.integer], height: int, width: int
) -> Texels:
    """Every texel that weighs on some point of some face, with the nearest face and its point."""
    corners = _corners(uv, faces, height, width)
    found = []
    for face, rows, columns in _used_pairs(corners, height, width):
        distance, barycentric = _nearest(np.stack([columns, rows], 1), corners[face])
        found.append((rows * width + columns, distance, face, barycentric))
    texel, distance, face, barycentric = (np.concatenate(part) for part in zip(*found, strict=True))
    order = np.lexsort((face, distance, texel))
    first = order[np.unique(texel[order], return_index=True)[1]]
    rows, columns = np.divmod(texel[first], width)
    return Texels(rows, columns, face[first], barycentric[first])


def used_texels(
    uv: NDArray[np.floating], faces: NDArray[np.integer], height: int, width: int
) -> NDArray[np.bool_]:
    """Mask (H,W) of the texels with bilinear weight on some surface point."""
    mask = np.zeros((height, width), bool)
    for _, rows, columns in _used_pairs(_corners(uv, faces, height, width), height, width):
        mask[rows, columns] = True
    return mask


def dilate(texture: NDArray[np.float32], mask: NDArray[np.bool_]) -> NDArray[np.float32]:
    """The texture (H,W,3) with every texel outside mask (H,W) copied from the nearest inside."""
    rows, columns = distance_transform_edt(~mask, return_distances=False, return_indices=True)
    return np.ascontiguousarray(texture[rows, columns])


def has_overlap(uv: NDArray[np.floating], faces: NDArray[np.integer], resolution: int) -> bool:
    """Whether two faces cover each other by more than 0.001 of a texel."""
    corners = _corners(uv, faces, resolution, resolution)
    pairs = list(_used_pairs(corners, resolution, resolution))
    texel = np.concatenate([rows * resolution + columns for _, rows, columns in pairs])
    face = np.concatenate([pair[0] for pair in pairs])
    order = np.lexsort((face, texel))
    texel, face = texel[order], face[order]
    offset, meeting = 1, np.zeros(0, np.int64)
    while (same := texel[offset:] == texel[:-offset]).any():
        codes = face[:-offset][same] * len(faces) + face[offset:][same]
        meeting = np.union1d(meeting, codes)
        offset += 1
    first, second = np.divmod(meeting, len(faces))
    return bool((_overlap_depth(corners[first], corners[second]) > _TOUCH).any())


def _corners(
    uv: NDArray[np.floating], faces: NDArray[np.integer], height: int, width: int
) -> Floats:
    """Corners (F,3,2) in texel positions (x, y)."""
    return (uv.astype(np.float64) * [width, height] - 0.5)[faces]


def _used_pairs(corners: Floats, height: int, width: int) -> Iterator[Pairs]:
    """Chunks of (face, row, column) such that the texel weighs on the face."""
    last = np.array([width, height]) - 1
    low = np.clip(np.floor(corners.min(1)).astype(np.int64), 0, last)
    high = np.clip(np.ceil(corners.max(1)).astype(np.int64), 0, last)
    spans = high - low + 1
    counts = spans.prod(1)
    chunk = (np.cumsum(counts) - counts) // _PAIRS_AT_ONCE
    for members in np.split(np.arange(len(corners)), np.flatnonzero(np.diff(chunk)) + 1):
        face = np.repeat(members, counts[members])
        starts = np.cumsum(counts[members]) - counts[members]
        within = np.arange(len(face)) - np.repeat(starts, counts[members])
        rows, columns = np.divmod(within, spans[face, 0])
        rows, columns = rows + low[face, 1], columns + low[face, 0]
        used = _footprint_meets(np.stack([columns, rows], 1), corners[face])
        yield face[used], rows[used], columns[used]


def _footprint_meets(centres: Ints, corners: Floats) -> NDArray[np.bool_]:
    """Whether the square of half-width 1 at each centre (K,2) meets its face (K,3,2)."""
    relative = corners - centres[:, None]
    meets = (relative.min(1) < 1).all(1) & (relative.max(1) > -1).all(1)
    for edge in range(3):
        along = relative[:, (edge + 1) % 3] - relative[:, edge]
        normal = np.stack([-along[:, 1], along[:, 0]], 1)
        heights = np.einsum("kcd,kd->kc", relative, normal)
        reach = np.abs(normal).sum(1)
        meets &= (heights.min(1) <= reach) & (heights.max(1) >= -reach)
    return meets


def _nearest(points: Ints, corners: Floats) -> tuple[Floats, Floats]:
    """Distance (K,) and barycentrics (K,3) of the point of each face nearest to each point."""
    a, b, c = (corners[:, i] for i in range(3))
    area = _cross(b - a, c - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        areas = [_cross(c - b, points - b), _cross(a - c, points - c), _cross(b - a, points - a)]
        inner = np.stack(areas, 1) / area[:, None]
    inside = (area != 0) & (inner >= 0).all(1)
    barycentric = np.where(inside[:, None], inner, 0.0)
    distance = np.where(inside, 0.0, np.inf)
    for edge in range(3):
        start, end = edge, (edge + 1) % 3
        along = corners[:, end] - corners[:, start]
        length2 = np.maximum((along**2).sum(1), np.finfo(float).tiny)
        t = np.clip(((points - corners[:, start]) * along).sum(1) / length2, 0, 1)
        gap = np.linalg.norm(corners[:, start] + t[:, None] * along - points, axis=1)
        nearer = gap < distance
        distance[nearer] = gap[nearer]
        barycentric[nearer] = 0.0
        barycentric[nearer, start] = 1 - t[nearer]
        barycentric[nearer, end] = t[nearer]
    return distance, barycentric


def _overlap_depth(first: Floats, second: Floats) -> Floats:
    """Smallest overlap (P,) of the projections of two faces on their six edge normals."""
    depth = np.full(len(first), np.inf)
    for triangle in (first, second):
        for edge in range(3):
            along = triangle[:, (edge + 1) % 3] - triangle[:, edge]
            normal = np.stack([-along[:, 1], along[:, 0]], 1)
            length = np.linalg.norm(normal, axis=1, keepdims=True)
            normal = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
            p, q = (np.einsum("kcd,kd->kc", t, normal) for t in (first, second))
            overlap = np.minimum(p.max(1), q.max(1)) - np.maximum(p.min(1), q.min(1))
            depth = np.minimum(depth, overlap)
    return depth


def _cross(a: Floats, b: Floats) -> Floats:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
