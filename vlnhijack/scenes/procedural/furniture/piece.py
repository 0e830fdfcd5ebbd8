"""A piece of furniture, and its surface in a house."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vlnhijack.scenes.procedural.materials import Material
from vlnhijack.scenes.procedural.painting import paint
from vlnhijack.scenes.procedural.shapes import Mesh, join
from vlnhijack.scenes.surface import Surface
from vlnhijack.scenes.uv_atlas import unwrap


@dataclass(frozen=True, eq=False)
class Part:
    """A mesh of one material."""

    mesh: Mesh
    material: Material


@dataclass(frozen=True, eq=False)
class Piece:
    """Furniture in its own frame: base on z = 0, centred on x = y = 0, its front towards +y."""

    category: str
    parts: tuple[Part, ...]

    @cached_property
    def mesh(self) -> Mesh:
        """All parts as one mesh."""
        return join(part.mesh for part in self.parts)

    @property
    def size(self) -> tuple[float, float, float]:
        """Width (x), depth (y) and height (z) in metres."""
        x, y, z = np.ptp(self.mesh.vertices, axis=0)
        return float(x), float(y), float(z)

    @property
    def texels(self) -> int:
        """A texture edge that suits the piece: 128 to 256 by its area."""
        corners = self.mesh.vertices[self.mesh.faces]
        sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area = np.linalg.norm(sides, axis=1).sum() / 2
        return int(np.clip(64 * np.ceil(1.6 * np.sqrt(area)), 128, 256))


def assemble(category: str, *parts: Part) -> Piece:
    """A piece of the parts, moved so that it stands on z = 0 and is centred on x = y = 0."""
    vertices = np.concatenate([part.mesh.vertices for part in parts])
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    x, y = -(low + high)[:2] / 2
    return Piece(category, tuple(Part(p.mesh.moved(x, y, -low[2]), p.material) for p in parts))


def place(
    piece: Piece,
    name: str,
    object_id: str | None,
    position: tuple[float, float, float],
    heading: float,
    texels: int,
) -> Surface:
    """The piece as a surface with its base centre at `position` (metres), its front looking along
    `heading` (radians, 0 along +y, clockwise), and a texture of texels² of its own."""
    mesh = piece.mesh
    atlas = unwrap(mesh.vertices, mesh.faces, texels)
    vertices = mesh.vertices[atlas.source]
    owner = np.repeat(np.arange(len(piece.parts)), [len(p.mesh.faces) for p in piece.parts])
    materials = [part.material for part in piece.parts]
    texture = paint(vertices, atlas.faces, atlas.uv, owner, materials, atlas.height, atlas.width)
    return Surface(
        name=name,
        vertices=_turned(vertices, heading, position),
        faces=atlas.faces,
        uv=atlas.uv,
        texture=texture,
        object_id=object_id,
    )


def _turned(
    vertices: NDArray[np.float64], heading: float, position: tuple[float, float, float]
) -> NDArray[np.float32]:
    clockwise = Mesh(vertices, np.zeros((0, 3), np.int64)).turned("z", -heading)
    return clockwise.moved(*position).vertices.astype(np.float32)
