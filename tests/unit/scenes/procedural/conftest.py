from dataclasses import dataclass

import numpy as np
import pytest
import trimesh

from vlnhijack.navigation.graph import NavigationGraph
from vlnhijack.scenes.house import House
from vlnhijack.scenes.procedural import house_maker
from vlnhijack.scenes.procedural.room_layout import Placement
from vlnhijack.scenes.surface import Surface


@dataclass(frozen=True)
class Sketch:
    """A made house whose furniture is not unwrapped and not painted, and what it was made from."""

    house: House
    placements: list[Placement]
    mesh: trimesh.Trimesh

    @property
    def graph(self) -> NavigationGraph:
        return self.house.graph


def _place_unpainted(
    piece: object, name: str, object_id: str, position: object, heading: float, texels: int
) -> Surface:
    placement = Placement(piece, 0, position, heading, large=False)  # type: ignore[arg-type]
    vertices = placement.vertices.astype(np.float32)
    faces = placement.piece.mesh.faces.astype(np.int32)
    uv = np.zeros((len(vertices), 2), np.float32)
    return Surface(name, vertices, faces, uv, np.zeros((1, 1, 3), np.float32), object_id)


@pytest.fixture(scope="session")
def sketch() -> Sketch:
    return make_sketch(3)


def make_sketch(seed: int) -> Sketch:
    kept: list[Placement] = []
    furnish = house_maker.furnish

    def recording_furnish(*args: object) -> list[Placement]:
        kept[:] = furnish(*args)  # type: ignore[arg-type]
        return kept

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(house_maker, "place", _place_unpainted)
        patch.setattr(house_maker, "furnish", recording_furnish)
        house = house_maker.make_house("sketch", seed)
    meshes = [trimesh.Trimesh(s.vertices, s.faces, process=False) for s in house.surfaces]
    return Sketch(house, kept, trimesh.util.concatenate(meshes))
