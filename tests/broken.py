"""Fast paths that are broken on purpose, through the public face of `FrozenRenderer` alone.

Each takes a scene, samples per pixel and a seed, and renders what a wrong operator would.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import torch
from torch.nn.functional import hardtanh

from tests.hard_scenes import TARGET, Mesh, Scene, join
from tests.parity import Render
from vlnhijack.rendering.frozen_renderer import FrozenRenderer
from vlnhijack.scenes.surface import Surface


def _frozen(scene: Scene, spp: int, seed: int) -> FrozenRenderer:
    return FrozenRenderer(scene.house, TARGET, scene.cameras, spp, seed)


def _with(scene: Scene, target: Surface) -> Scene:
    rest = [s for s in scene.house.surfaces if s.object_id is None]
    return scene._replace(house=replace(scene.house, surfaces=(*rest, target)))


def _shifted(scene: Scene, spp: int, seed: int) -> Render:
    target = scene.house.surface(TARGET)
    height, width, _ = target.texture.shape
    half = np.float32([0.5 / width, 0.5 / height])
    return _frozen(_with(scene, replace(target, uv=target.uv + half)), spp, seed)


def _swapped(scene: Scene, spp: int, seed: int) -> Render:
    target = scene.house.surface(TARGET)
    return _frozen(_with(scene, replace(target, uv=target.uv[:, ::-1].copy())), spp, seed)


def _turned_round(scene: Scene, spp: int, seed: int) -> Render:
    target = scene.house.surface(TARGET)
    return _frozen(_with(scene, replace(target, faces=target.faces[:, ::-1].copy())), spp, seed)


def _repeated(scene: Scene, spp: int, seed: int) -> Render:
    """Four more textures on each side, for uv down to -2 and up to 3."""
    target = scene.house.surface(TARGET)
    tiled = replace(target, uv=(target.uv + 2) / np.float32(5), texture=_tiled(target, 5))
    frozen = _frozen(_with(scene, tiled), spp, seed)
    return lambda texture: frozen(texture.repeat(5, 5, 1))


def _nearest(scene: Scene, spp: int, seed: int) -> Render:
    """Blocks of 64 × 64 equal texels, so that next to nothing is blended."""
    target = scene.house.surface(TARGET)
    frozen = _frozen(_with(scene, replace(target, texture=_tiled(target, 64))), spp, seed)
    return lambda texture: frozen(torch.kron(texture, torch.ones(64, 64, 1)))


def _tiled(target: Surface, times: int) -> np.ndarray:
    return np.tile(target.texture, (times, times, 1))


def _background_taken(scene: Scene, spp: int, seed: int) -> Render:
    target = scene.house.surface(TARGET)
    vertices, faces, uv = join(*(Mesh(s.vertices, s.faces, s.uv) for s in scene.house.surfaces))
    whole = replace(target, vertices=vertices, faces=faces.astype(np.int32), uv=uv)
    return _frozen(_alone(_with(scene, whole)), spp, seed)


def _occluders_ignored(scene: Scene, spp: int, seed: int) -> Render:
    return _frozen(_alone(scene), spp, seed)


def _alone(scene: Scene) -> Scene:
    return scene._replace(house=replace(scene.house, surfaces=(scene.house.surface(TARGET),)))


def _lost(scene: Scene, spp: int, seed: int) -> Render:
    frozen = _frozen(scene, spp, seed)
    return lambda texture: frozen(texture * (1 - 1 / spp))


def _other_rays(scene: Scene, spp: int, seed: int) -> Render:
    return _frozen(scene, spp, seed + 1)


def _flat_at_the_clamp(scene: Scene, spp: int, seed: int) -> Render:
    frozen = _frozen(scene, spp, seed)
    return lambda texture: frozen(hardtanh(texture, 0.0, 1.0))


BREAK: dict[str, Callable[[Scene, int, int], Render]] = {
    "half a texel off": _shifted,
    "u and v swapped": _swapped,
    "faces turned round": _turned_round,
    "repeated, not clamped": _repeated,
    "nearest texel": _nearest,
    "background taken for the object": _background_taken,
    "occluders ignored": _occluders_ignored,
    "a ray lost": _lost,
    "other rays": _other_rays,
    "no gradient at the clamp": _flat_at_the_clamp,
}
