"""Views of whole houses: rendered, described for training, encoded."""

from collections.abc import Callable, Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from vlnhijack.agents.encoder import ViewEncoder
from vlnhijack.agents.training.encoder import ViewTargets
from vlnhijack.errors import InputError
from vlnhijack.frames import Camera
from vlnhijack.navigation.graph import NavigationGraph
from vlnhijack.navigation.views import VIEWS, panorama_cameras
from vlnhijack.rendering.coverage import depth_map, object_coverage, object_index_map
from vlnhijack.rendering.observe import render_views
from vlnhijack.scenes.house import House, nearest_room

_CHUNK = 8 * VIEWS
Advance = Callable[[int], None]


def house_cameras(graph: NavigationGraph, width: int, height: int) -> list[Camera]:
    """Cameras of all 36·M views of a scan, viewpoint after viewpoint."""
    return [
        camera
        for x, y, z in graph.positions.tolist()
        for camera in panorama_cameras((x, y, z), width, height)
    ]


def encode_house(
    house: House,
    encoder: ViewEncoder,
    spp: int,
    seed: int,
    advance: Advance = lambda views: None,
) -> Tensor:
    """Features (M,36,D) of all views of a house."""
    height, width = encoder.image_size
    cameras = house_cameras(house.graph, width, height)
    features = encode_cameras(house, encoder, cameras, spp, seed, advance)
    return features.view(-1, VIEWS, encoder.feature_size)


def encode_cameras(
    house: House,
    encoder: ViewEncoder,
    cameras: Sequence[Camera],
    spp: int,
    seed: int,
    advance: Advance = lambda views: None,
) -> Tensor:
    """Features (V,D) of V cameras, rendered a few at a time."""
    features = []
    for start in range(0, len(cameras), _CHUNK):
        part = cameras[start : start + _CHUNK]
        images = render_views(house, part, spp, seed + start)
        with torch.no_grad():
            features.append(encoder(images))
        advance(len(part))
    return torch.cat(features)


def coverage_table(house: House, width: int, height: int) -> NDArray[np.float32]:
    """Share (M,36,O) of every view that each object of the house fills."""
    cameras = house_cameras(house.graph, width, height)
    return object_coverage(house, cameras).reshape(-1, VIEWS, len(house.objects))


def view_targets(
    house: House,
    categories: Sequence[str],
    rooms: Sequence[str],
    *,
    width: int,
    height: int,
    patch: int,
    spp: int,
    seed: int,
) -> ViewTargets:
    """All views of a house and what they show, for the proxy tasks of the encoder."""
    cameras = house_cameras(house.graph, width, height)
    images = render_views(house, cameras, spp, seed)
    category = np.array([categories.index(o.category) for o in house.objects] + [len(categories)])
    shown = category[object_index_map(house, cameras)]
    log_depth = np.log(np.clip(depth_map(house, cameras), 0.05, 30.0))
    share = np.stack([shown == c for c in range(len(categories) + 1)], -1).astype(np.float32)
    return ViewTargets(
        images=(images * 255).round().to(torch.uint8),
        patch_fractions=torch.from_numpy(_patch_means(share, patch)),
        patch_depth=torch.from_numpy(_patch_means(log_depth[..., None], patch)[..., 0]),
        rooms=torch.tensor(_room_labels(house, rooms)).repeat_interleave(VIEWS),
    )


def _patch_means(values: NDArray[np.float32], patch: int) -> NDArray[np.float32]:
    views, height, width, channels = values.shape
    tiles = values.reshape(views, height // patch, patch, width // patch, patch, channels)
    return tiles.mean((2, 4), dtype=np.float32).reshape(views, -1, channels)


def _room_labels(house: House, rooms: Sequence[str]) -> list[int]:
    labels = []
    for x, y, _ in house.graph.positions.tolist():
        label = nearest_room(house.rooms, x, y).label
        if label not in rooms:
            raise InputError(file=house.name, field="rooms", expected=rooms, received=label)
        labels.append(rooms.index(label))
    return labels
