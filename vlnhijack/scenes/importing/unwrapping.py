"""Give an object one surface with a texture of its own, resampled from the textures it shared."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vlnhijack.errors import InputError
from vlnhijack.scenes.house import House
from vlnhijack.scenes.importing.lookup import look_up
from vlnhijack.scenes.surface import Surface
from vlnhijack.scenes.uv_atlas import Atlas, Texels, dilate, rasterise, unwrap

SMALLEST, LARGEST, STEP = 256, 2048, 64
TEXELS_PER_TEXEL = 1.5  # along an edge: resampling at the same density would blur
FILLED = 0.5  # share of an atlas that charts cover
_DENSE = 0.95

Floats = NDArray[np.float64]


def unwrapped(house: House, object_ids: Iterable[str]) -> House:
    """The house in which these objects can be attacked; InputError where it lacks one."""
    wanted = [i for i in dict.fromkeys(object_ids) if not house.object(i).unwrapped]
    if not wanted:
        return house
    kept = tuple(surface for surface in house.surfaces if surface.object_id not in wanted)
    made = tuple(unwrap_object(i, house.parts(i)) for i in wanted)
    objects = tuple(replace(o, unwrapped=o.unwrapped or o.id in wanted) for o in house.objects)
    return replace(house, surfaces=kept + made, objects=objects)


def unwrap_object(
    object_id: str, parts: Sequence[Surface], resolution: int | None = None
) -> Surface:
    """One surface of all parts: a UV atlas of the object, and its texels as the parts look there.

    The texture has resolution² texels, by default as fine as the parts' own, so that views stay the
    same (PSNR ≥ 35 dB).
    Charts do not cross from part to part, since colours end there. Deterministic.
    """
    vertices, faces = _joined(parts)
    atlas = _unwrap_apart(parts, faces, resolution or _resolution(parts))
    texels = rasterise(atlas.uv, atlas.faces, atlas.height, atlas.width)
    texture = np.zeros((atlas.height, atlas.width, 3), np.float32)
    used = np.zeros(texture.shape[:2], bool)
    texture[texels.rows, texels.columns] = _colours(parts, texels)
    used[texels.rows, texels.columns] = True
    return Surface(
        name=object_id,
        vertices=vertices[atlas.source],
        faces=atlas.faces,
        uv=atlas.uv,
        texture=dilate(texture, used),
        object_id=object_id,
    )


def _joined(parts: Sequence[Surface]) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    starts = np.cumsum([0] + [len(part.vertices) for part in parts])
    faces = [part.faces + start for part, start in zip(parts, starts, strict=False)]
    vertices = np.concatenate([part.vertices for part in parts])
    return vertices, np.concatenate(faces).astype(np.int32)


def _unwrap_apart(parts: Sequence[Surface], faces: NDArray[np.int32], resolution: int) -> Atlas:
    """The atlas of all parts, moved away from each other so that they share no chart."""
    low, high = (f([f(p.vertices, axis=0) for p in parts], axis=0) for f in (np.min, np.max))
    stride = np.array([2 * float(high[0] - low[0]) + 1, 0, 0])
    moved = np.concatenate(
        [part.vertices - low + number * stride for number, part in enumerate(parts)]
    )
    try:
        return unwrap(moved, faces, resolution)
    except InputError:
        if resolution >= 2 * LARGEST:
            raise
        return _unwrap_apart(parts, faces, min(2 * resolution, 2 * LARGEST))


def _resolution(parts: Sequence[Surface]) -> int:
    """Edge of a square texture that is as fine as those of the parts nearly everywhere."""
    areas = np.concatenate([_areas(part.vertices, part.faces) for part in parts])
    texels = np.concatenate(
        [_areas(part.uv * part.texture.shape[1::-1], part.faces) for part in parts]
    )
    density = texels / np.maximum(areas, np.finfo(float).tiny)
    order = np.argsort(density)
    rank = np.searchsorted(np.cumsum(areas[order]), _DENSE * areas.sum())
    dense = density[order[min(rank, len(order) - 1)]]
    edge = TEXELS_PER_TEXEL * np.sqrt(dense * areas.sum() / FILLED)
    return int(np.clip(STEP * np.ceil(edge / STEP), SMALLEST, LARGEST))


def _areas(points: NDArray[np.floating], faces: NDArray[np.int32]) -> Floats:
    """Areas (F,) of triangles of points (N,2) or (N,3)."""
    a, b, c = (points[faces[:, i]].astype(np.float64) for i in range(3))
    u, v = b - a, c - a
    squares = (u**2).sum(1) * (v**2).sum(1) - (u * v).sum(1) ** 2
    return np.asarray(np.sqrt(np.maximum(squares, 0)) / 2)


def _colours(parts: Sequence[Surface], texels: Texels) -> NDArray[np.float32]:
    """Colours (K,3) of the points of the parts that K texels stand for."""
    colours = np.empty((len(texels.face), 3), np.float32)
    first = 0
    for part in parts:
        mine = (texels.face >= first) & (texels.face < first + len(part.faces))
        corners = part.uv[part.faces[texels.face[mine] - first]]
        uv = np.einsum("kc,kcd->kd", texels.barycentric[mine], corners)
        colours[mine] = look_up(part.texture, uv, part.wrap)
        first += len(part.faces)
    return colours
