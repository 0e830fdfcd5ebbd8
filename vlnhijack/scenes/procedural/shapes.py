"""Closed triangle meshes from which furniture is built.

Lengths in metres, z up. Every primitive is closed and counter-clockwise seen from outside, because
emitters are one-sided. `at` is the centre of a primitive's bottom unless said otherwise.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Point = tuple[float, float, float]
ORIGIN: Point = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Mesh:
    """vertices (N,3) float64 metres; faces (F,3) int, counter-clockwise seen from outside."""

    vertices: Array
    faces: NDArray[np.int64]

    def moved(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> "Mesh":
        """The mesh shifted by (x, y, z) metres."""
        return Mesh(self.vertices + np.array([x, y, z]), self.faces)

    def turned(self, axis: str, angle: float, about: Point = ORIGIN) -> "Mesh":
        """The mesh rotated right-handedly by `angle` radians around axis "x", "y" or "z"."""
        i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
        p = self.vertices - about
        q = p.copy()
        q[:, i] = np.cos(angle) * p[:, i] - np.sin(angle) * p[:, j]
        q[:, j] = np.sin(angle) * p[:, i] + np.cos(angle) * p[:, j]
        return Mesh(q + about, self.faces)

    def scaled(self, x: float, y: float, z: float) -> "Mesh":
        """The mesh scaled by positive factors around the origin."""
        return Mesh(self.vertices * np.array([x, y, z]), self.faces)

    def mirrored(self) -> "Mesh":
        """The mesh mirrored at the plane x = 0, still facing outwards."""
        return Mesh(self.vertices * np.array([-1.0, 1.0, 1.0]), self.faces[:, ::-1])


def join(meshes: Iterable[Mesh]) -> Mesh:
    """One mesh that holds all of `meshes`."""
    parts = list(meshes)
    starts = np.cumsum([0] + [len(m.vertices) for m in parts])
    return Mesh(
        np.concatenate([m.vertices for m in parts]),
        np.concatenate([m.faces + s for m, s in zip(parts, starts, strict=False)]),
    )


def loft(rings: ArrayLike, cyclic: bool = False) -> Mesh:
    """The closed skin over rings (M,K,3): capped by fans or, if cyclic, from the last to the first.

    Each ring is counter-clockwise seen from the side of the last ring; of a cyclic skin the outer
    ones go up and the inner ones down.
    """
    r = np.asarray(rings, float)
    m, k, _ = r.shape
    i, j = np.meshgrid(np.arange(m if cyclic else m - 1) * k, np.arange(k), indexing="ij")
    a, b = i + j, i + (j + 1) % k
    c, d = (b + k) % (m * k), (a + k) % (m * k)
    sides = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
    if cyclic:
        return Mesh(r.reshape(-1, 3), sides)
    fan = np.stack([np.zeros(k - 2, int), np.arange(1, k - 1), np.arange(2, k)], axis=-1)
    return Mesh(r.reshape(-1, 3), np.concatenate([sides, fan[:, ::-1], fan + (m - 1) * k]))


def rectangle(width: float, depth: float, z: float, radius: float = 0.0, steps: int = 2) -> Array:
    """A counter-clockwise ring around a rectangle in the plane z, its corners rounded."""
    if radius <= 0:
        corners = [(1, -1), (1, 1), (-1, 1), (-1, -1)]
        return np.array([(sx * width / 2, sy * depth / 2, z) for sx, sy in corners])
    angles = np.linspace(0, np.pi / 2, steps + 1)
    ring = []
    for quarter, (sx, sy) in enumerate([(1, 1), (-1, 1), (-1, -1), (1, -1)]):
        a = angles + quarter * np.pi / 2
        x = sx * (width / 2 - radius) + radius * np.cos(a)
        y = sy * (depth / 2 - radius) + radius * np.sin(a)
        ring.append(np.stack([x, y, np.full_like(a, z)], axis=-1))
    return np.concatenate(ring)


def box(width: float, depth: float, height: float, at: Point = ORIGIN) -> Mesh:
    """An axis-aligned box: width along x, depth along y, height along z."""
    return loft([rectangle(width, depth, z) for z in (0.0, height)]).moved(*at)


def taper(
    bottom: tuple[float, float],
    top: tuple[float, float],
    height: float,
    at: Point = ORIGIN,
    lean: tuple[float, float] = (0.0, 0.0),
) -> Mesh:
    """A box whose top rectangle (width, depth) differs from its bottom one and is moved by lean."""
    upper = rectangle(*top, height) + np.array([*lean, 0.0])
    return loft([rectangle(*bottom, 0.0), upper]).moved(*at)


def cushion(
    width: float, depth: float, height: float, radius: float, at: Point = ORIGIN, crown: float = 0.0
) -> Mesh:
    """A box with rounded edges, its top raised by `crown` in the middle."""
    r = min(radius, 0.49 * height, 0.49 * width, 0.49 * depth)
    rings = []
    for angle in np.linspace(-np.pi / 2, 0, 3):
        rings.append((np.cos(angle), r + r * np.sin(angle)))
    for angle in np.linspace(0, np.pi / 2, 3):
        rings.append((np.cos(angle), height - r + r * np.sin(angle)))
    skin = []
    for cosine, z in rings:
        inset = 2 * r * (1 - cosine)
        corner = max(r * cosine, 0.15 * r)
        skin.append(rectangle(width - inset, depth - inset, z, corner))
    if crown > 0:
        last = skin[-1]
        skin.append(last * (0.5, 0.5, 1.0) + np.array([0.0, 0.0, crown]))
    return loft(skin).moved(*at)


def circle(radius: float, z: float, sides: int) -> Array:
    """A counter-clockwise ring (sides,3) in the plane z."""
    a = np.arange(sides) * 2 * np.pi / sides
    return np.stack([radius * np.cos(a), radius * np.sin(a), np.full(sides, z)], axis=-1)


def lathe(profile: Sequence[tuple[float, float]], sides: int = 16, at: Point = ORIGIN) -> Mesh:
    """A solid of revolution of (radius, z) points: upward outside, then, for a vessel, downward
    inside."""
    return loft([circle(max(r, 1e-4), z, sides) for r, z in profile]).moved(*at)


def cylinder(radius: float, height: float, at: Point = ORIGIN, sides: int = 14) -> Mesh:
    return lathe([(radius, 0.0), (radius, height)], sides, at)


def cone(bottom: float, top: float, height: float, at: Point = ORIGIN, sides: int = 14) -> Mesh:
    """A truncated cone with a bottom and a top radius."""
    return lathe([(bottom, 0.0), (top, height)], sides, at)


def ball(radius: float, centre: Point, sides: int = 12) -> Mesh:
    a = np.linspace(-np.pi / 2, np.pi / 2, sides // 2 + 2)
    return lathe([(radius * np.cos(t), radius * np.sin(t)) for t in a], sides, centre)


def shell(outline: ArrayLike, floor: float, height: float, rim: float) -> Mesh:
    """An open vessel: outline (K,3) ring at z = 0 scaled inwards by `rim` metres inside, its inner
    bottom at z = floor."""
    ring = np.asarray(outline, float)
    size = ring.max(axis=0)[:2] - ring.min(axis=0)[:2]
    inner = ring * np.array([*(1 - 2 * rim / size), 1.0])
    up = np.array([0.0, 0.0, 1.0])
    bottom = inner * np.array([0.85, 0.85, 1.0])
    return loft([ring, ring + height * up, inner + height * up, bottom + floor * up])


def sweep(path: ArrayLike, radius: ArrayLike, sides: int = 8) -> Mesh:
    """A tube along a path (M,3) with one radius or one radius per point."""
    p = np.asarray(path, float)
    radii = np.broadcast_to(np.asarray(radius, float), len(p))
    tangent = np.gradient(p, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    spread = np.ptp(tangent, axis=0) + np.abs(tangent).mean(axis=0)
    reference = np.eye(3)[int(np.argmin(spread))]
    u = np.cross(reference, tangent)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(tangent, u)
    a = np.arange(sides) * 2 * np.pi / sides
    offset = np.cos(a)[None, :, None] * u[:, None] + np.sin(a)[None, :, None] * v[:, None]
    return loft(p[:, None] + radii[:, None, None] * offset)


def bar(start: Point, end: Point, radius: float, sides: int = 8) -> Mesh:
    """A straight rod between two points."""
    return sweep([start, end], radius, sides)


def leaf(
    length: float,
    width: float,
    bend: float,
    tip: float = 0.0,
    segments: int = 4,
    fold: float = 0.15,
) -> Mesh:
    """A thin leaf that starts at the origin along +y and curves down by `bend` radians.

    It is two skins 2 mm apart, back to back, so that both sides show; `tip` in [0,1] moves the
    widest point towards the tip; `fold` raises its edges by that share of the width.
    """
    t = np.linspace(0, 1, segments + 1)
    angle = bend * t
    step = length / segments
    y = np.concatenate([[0], np.cumsum(step * np.cos(angle[:-1]))])
    z = np.concatenate([[0], np.cumsum(-step * np.sin(angle[:-1]))])
    half = width / 2 * np.sin(np.pi * t ** (1 + tip) * 0.96 + 0.04 * np.pi * (1 - t))
    left = np.stack([-half, y, z + fold * 2 * half], axis=-1)
    right = left * np.array([-1.0, 1.0, 1.0])
    middle = np.stack([0 * y, y, z], axis=-1)
    upper = np.stack([left, middle, right], axis=1).reshape(-1, 3)
    faces = []
    for i in range(segments):
        for j in range(2):
            a, b = 3 * i + j, 3 * i + j + 1
            faces += [(a, b, b + 3), (a, b + 3, a + 3)]
    top = np.array(faces)
    lower = upper - np.array([0.0, 0.0, 0.002])
    return Mesh(np.concatenate([upper, lower]), np.concatenate([top, top[:, ::-1] + len(upper)]))
