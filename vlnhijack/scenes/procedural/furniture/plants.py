"""Potted plants."""

import numpy as np

from vlnhijack.scenes.procedural.furniture.piece import Part, Piece, assemble
from vlnhijack.scenes.procedural.materials import glazed, leaves, solid, wood
from vlnhijack.scenes.procedural.shapes import Mesh, join, lathe, leaf, sweep

GOLDEN = np.pi * (3 - np.sqrt(5))


def plant(rng: np.random.Generator, large: bool) -> Piece:
    """A potted plant; large: 1.5-1.9 m with a dense crown of broad leaves."""
    if large:
        return _palm(rng, rng.uniform(0.9, 1.1), 0.8) if rng.random() < 0.15 else _bush(rng)
    kind = rng.integers(3)
    if kind == 0:
        return _palm(rng, rng.uniform(0.1, 0.4), rng.uniform(0.4, 0.55))
    return _rosette(rng) if kind == 1 else _sword_plant(rng)


def _pot(rng: np.random.Generator, radius: float, height: float) -> list[Part]:
    profile = [
        (0.7 * radius, 0.0), (0.78 * radius, 0.02), (0.97 * radius, height - 0.05),
        (1.05 * radius, height - 0.045), (1.05 * radius, height), (0.93 * radius, height),
        (0.9 * radius, height - 0.04),
    ]  # fmt: skip
    return [
        Part(lathe(profile, 18), glazed(rng)),
        Part(lathe([(0.85 * radius, height - 0.06), (0.91 * radius, height - 0.025)], 14),
             solid((0.2, 0.13, 0.08))),
    ]  # fmt: skip


def _aim(blade: Mesh, around: float, up: float, at: tuple[float, float, float]) -> Mesh:
    """A leaf turned to elevation `up` and azimuth `around` (radians), its foot at `at`."""
    return blade.turned("x", up).turned("z", around).moved(*at)


def _bush(rng: np.random.Generator) -> Piece:
    """Three or four stems in a large pot that carry broad leaves from bottom to top."""
    height, spread = rng.uniform(1.65, 1.9), rng.uniform(0.5, 0.6)
    pot = rng.uniform(0.3, 0.4)
    count, width = int(rng.integers(92, 104)), rng.uniform(0.24, 0.34)
    blades = []
    for i in range(count):
        t = (i + 0.5) / count
        around = GOLDEN * i + rng.uniform(-0.3, 0.3)
        z = pot + 0.02 + (height - pot - 0.22) * t
        bulge = np.sin(np.pi * (0.25 + 0.6 * t))
        out = spread * bulge * rng.uniform(0.25, 0.75)
        at = (-out * np.sin(around), out * np.cos(around), z)
        size = rng.uniform(0.34, 0.44)
        blade = leaf(size, width * rng.uniform(0.8, 1.15), rng.uniform(0.6, 1.2), segments=3)
        blades.append(_aim(blade, around, rng.uniform(0.1, 0.7) + 0.6 * t, at))
    stems = []
    for a in np.arange(4) * np.pi / 2 + rng.uniform(0, 1):
        out = spread * 0.35
        x, y = out * np.cos(a), out * np.sin(a)
        path = [(0.2 * x, 0.2 * y, pot - 0.08), (x, y, 0.6 * height), (x, y, height - 0.2)]
        stems.append(sweep(path, [0.02, 0.016, 0.008], 6))
    return assemble(
        "plant",
        *_pot(rng, rng.uniform(0.2, 0.26), pot),
        Part(join(stems), wood(rng, (0.35, 0.26, 0.16))),
        Part(join(blades), leaves(rng, spread, height)),
    )


def _palm(rng: np.random.Generator, trunk: float, reach: float) -> Piece:
    """A crown of long arching leaves of `reach` metres on a trunk `trunk` metres above the pot."""
    pot = 0.2 + 0.1 * trunk
    count, broad = int(rng.integers(26, 34)), 0.11 + 0.1 * reach
    blades = []
    for i in range(count):
        around, level = GOLDEN * i, i / count
        at = (0.0, 0.0, pot + trunk * (0.6 + 0.4 * level))
        size, bend = reach * rng.uniform(0.8, 1.0), rng.uniform(0.9, 1.6)
        blade = leaf(size, broad, bend, tip=0.2, segments=6, fold=0.3)
        blades.append(_aim(blade, around, 0.45 + 0.8 * level, at))
    wide = 0.03 + 0.03 * trunk
    path = [(0.0, 0.0, pot - 0.08), (0.0, 0.0, pot + 1.02 * trunk)]
    return assemble(
        "plant",
        *_pot(rng, 0.14 + 0.07 * trunk, pot),
        Part(sweep(path, [wide, 0.6 * wide], 8), wood(rng, (0.4, 0.3, 0.18))),
        Part(join(blades), leaves(rng, 0.6 * reach, pot + trunk + 0.5 * reach)),
    )


def _rosette(rng: np.random.Generator) -> Piece:
    """A small pot of round leaves on stalks."""
    pot, blades = rng.uniform(0.18, 0.26), []
    count = int(rng.integers(26, 40))
    for i in range(count):
        t = i / count
        around = GOLDEN * i
        out, z = 0.14 * (1 - 0.7 * t), pot + 0.02 + 0.28 * t
        at = (-out * np.sin(around), out * np.cos(around), z)
        blade = leaf(rng.uniform(0.18, 0.26), rng.uniform(0.12, 0.17), 0.9, segments=4)
        blades.append(_aim(blade, around, 0.3 + 0.8 * t, at))
    return assemble(
        "plant", *_pot(rng, 0.15, pot), Part(join(blades), leaves(rng, 0.22, pot + 0.5))
    )


def _sword_plant(rng: np.random.Generator) -> Piece:
    """Sansevieria: stiff upright blades."""
    pot, blades = rng.uniform(0.2, 0.3), []
    tall = rng.uniform(0.45, 0.75)
    for i in range(int(rng.integers(14, 20))):
        around, out = GOLDEN * i, rng.uniform(0.02, 0.1)
        at = (-out * np.sin(around), out * np.cos(around), pot - 0.05)
        size = tall * rng.uniform(0.7, 1.1)
        blade = leaf(size, rng.uniform(0.08, 0.11), rng.uniform(0, 0.3), segments=5, fold=0.25)
        blades.append(_aim(blade, around, np.pi / 2 - rng.uniform(0.0, 0.3), at))
    return assemble(
        "plant", *_pot(rng, 0.15, pot), Part(join(blades), leaves(rng, 0.15, pot + tall))
    )
