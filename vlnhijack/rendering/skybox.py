"""The six images of a panorama, rendered."""

import numpy as np
from numpy.typing import NDArray

from vlnhijack import display
from vlnhijack.frames import Camera
from vlnhijack.rendering.observe import render_views
from vlnhijack.scenes.house import House

_LOOKS = ((0.0, 1.0), (0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 0.0), (0.0, -1.0))


def skybox_images(
    house: House, position: tuple[float, float, float], edge: int, spp: int = 16, seed: int = 0
) -> NDArray[np.uint8]:
    """Images (6, edge, edge, 3) of an upright skybox: up, +y, +x, −y, −x, down.

    As `scenes.matterport.skybox` reads them with the rotation `navigation.graph.UPRIGHT`.
    """
    cameras = [
        Camera(position, heading * np.pi / 2, elevation * np.pi / 2, edge, edge, np.pi / 2)
        for heading, elevation in _LOOKS
    ]
    images = render_views(house, cameras, spp, seed).permute(0, 2, 3, 1)
    return display.to_8bit(images.numpy())
