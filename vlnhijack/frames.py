"""Coordinate conversions: the only place.

World: metres, right-handed, z up. Heading 0 looks along +y and grows clockwise seen from above;
elevation is up-positive. Radians everywhere.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Camera:
    """A pinhole camera: pose and image size.

    position (3,) metres; heading, elevation and vertical_fov in radians; width, height in pixels.
    """

    position: tuple[float, float, float]
    heading: float
    elevation: float
    width: int
    height: int
    vertical_fov: float = np.pi / 3


def direction(heading: ArrayLike, elevation: ArrayLike = 0.0) -> Array:
    """Unit vectors (..., 3) that look along heading and elevation."""
    h, e = np.broadcast_arrays(np.asarray(heading, float), np.asarray(elevation, float))
    return np.stack([np.sin(h) * np.cos(e), np.cos(h) * np.cos(e), np.sin(e)], axis=-1)


def heading_of(vectors: ArrayLike) -> Array:
    """Headings (...) of vectors (..., 3) or (..., 2), in (-pi, pi]."""
    v = np.asarray(vectors, float)
    return np.arctan2(v[..., 0], v[..., 1])


def elevation_of(vectors: ArrayLike) -> Array:
    """Elevations (...) of vectors (..., 3)."""
    v = np.asarray(vectors, float)
    return np.arctan2(v[..., 2], np.hypot(v[..., 0], v[..., 1]))


def wrap(angle: ArrayLike) -> Array:
    """Angles wrapped to [-pi, pi)."""
    return (np.asarray(angle, float) + np.pi) % (2 * np.pi) - np.pi


def camera_to_world(camera: Camera) -> Array:
    """The 4×4 pose whose columns are right, up, forward (Mitsuba: -x, y, z) and position.

    Mitsuba's cameras look along their +z with +y up and +x to the *left*.
    """
    forward = direction(camera.heading, camera.elevation)
    right = direction(camera.heading + np.pi / 2)
    up = np.cross(right, forward)
    pose = np.eye(4)
    pose[:3, 0], pose[:3, 1], pose[:3, 2], pose[:3, 3] = -right, up, forward, camera.position
    return pose


def z_up_to_y_up(points: ArrayLike) -> Array:
    """Points (..., 3) from our z-up world to the y-up world of glTF."""
    p = np.asarray(points, float)
    return np.stack([p[..., 0], p[..., 2], -p[..., 1]], axis=-1)


def y_up_to_z_up(points: ArrayLike) -> Array:
    """The inverse of `z_up_to_y_up`."""
    p = np.asarray(points, float)
    return np.stack([p[..., 0], -p[..., 2], p[..., 1]], axis=-1)
