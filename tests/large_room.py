"""A room whose inside is one attackable surface of many faces, for tests of speed and memory."""

from dataclasses import replace

import numpy as np
from scipy.ndimage import zoom

from tests.houses import ROOM, tiny_house
from vlnhijack import seeds
from vlnhijack.scenes.house import House, HouseObject
from vlnhijack.scenes.surface import Surface

USED = 0.8  # of each side of a chart's cell, as packed atlases leave gaps
# corner and size in uv of each wall's cell: a texel is as large on the floor as on a wall
CELLS = [(0, 0.5), (0.5, 0.5), (0, 0.75), (0.5, 0.75), (0, 0), (0.5, 0)]


def large_room(side: int = 169, size: int = 1024) -> House:
    """Six walls of side² quads each (344k faces) with a bumpy surface, one texture of size²."""
    grid = np.linspace(0, 1, side + 1)
    a, b = np.meshgrid(grid, grid, indexing="ij")
    corners = _quads(side)
    vertices, faces, uv = [], [], []
    for wall in range(6):
        axis, far = divmod(wall, 2)
        points = np.empty((*a.shape, 3))
        points[..., [i for i in range(3) if i != axis]] = np.stack([a, b], -1)
        points[..., axis] = far + (0.5 - far) * 0.01 * np.sin(13 * np.pi * a) * np.sin(
            12 * np.pi * b
        )
        turned = corners if (axis == 1) == bool(far) else corners[:, ::-1]
        faces.append(turned + wall * a.size)
        vertices.append(((points - (0.5, 0.5, 0)) * ROOM).reshape(-1, 3))
        inside = np.stack([a, b], -1).reshape(-1, 2) * USED + (1 - USED) / 2
        uv.append(CELLS[wall] + inside * (0.5, 0.5 if axis == 2 else 0.25))
    random = seeds.stream(0, "large room")
    smooth = zoom(random.uniform(0.2, 0.8, (64, 64, 3)), (size / 64, size / 64, 1), order=1)
    texture = (smooth + random.uniform(-0.1, 0.1, smooth.shape)).astype(np.float32)
    room = Surface(
        "room",
        np.concatenate(vertices).astype(np.float32),
        np.concatenate(faces).astype(np.int32),
        np.concatenate(uv).astype(np.float32),
        texture,
        "room_0",
    )
    item = HouseObject("room_0", "cabinet", "room_0", (0.0, 0.0, ROOM[2] / 2), ROOM)
    return replace(tiny_house(), surfaces=(room,), objects=(item,))


def _quads(side: int) -> np.ndarray:
    """Faces (2·side², 3) of a grid of (side+1)² vertices."""
    index = np.arange((side + 1) ** 2).reshape(side + 1, side + 1)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    return np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
