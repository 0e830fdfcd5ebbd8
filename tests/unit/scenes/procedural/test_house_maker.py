import numpy as np
import pytest

from tests.unit.scenes.procedural.conftest import Sketch, make_sketch
from vlnhijack.errors import CheckError
from vlnhijack.scenes.procedural import house_maker


def test_same_seed_same_house(sketch: Sketch) -> None:
    again = make_sketch(3).house
    assert again.objects == sketch.house.objects
    assert again.lights == sketch.house.lights
    assert again.graph.viewpoints == sketch.graph.viewpoints
    for a, b in zip(again.surfaces, sketch.house.surfaces, strict=True):
        assert np.array_equal(a.vertices, b.vertices) and np.array_equal(a.texture, b.texture)


def test_objects_are_surfaces_in_rooms(sketch: Sketch) -> None:
    house = sketch.house
    owned = [s.object_id for s in house.surfaces if s.object_id is not None]
    assert sorted(owned) == sorted(o.id for o in house.objects)
    assert {o.room for o in house.objects} <= {room.id for room in house.rooms}
    for item in house.objects:
        vertices = house.surface(item.id).vertices
        assert np.allclose(np.ptp(vertices, axis=0), item.size)
        assert item.id.startswith(item.category)


def test_lights_shine_into_the_rooms(sketch: Sketch) -> None:
    centre = sketch.graph.positions.mean(axis=0)
    for light in sketch.house.lights:
        normal = np.cross(light.half_u, light.half_v)
        assert normal @ (centre - np.array(light.centre)) > 0
        assert min(light.radiance) > 0


def test_rooms_have_different_walls(sketch: Sketch) -> None:
    shells = [s.texture for s in sketch.house.surfaces if s.object_id is None]
    colours = [shell.mean(axis=(0, 1)) for shell in shells]
    assert len(shells) == len(sketch.house.rooms)
    assert len({tuple(np.round(colour, 3)) for colour in colours}) == len(shells)


def test_gives_up_with_one_clear_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(house_maker, "furnish", lambda *_: [])
    with pytest.raises(CheckError, match="no walkable house"):
        house_maker.make_house("empty", 0)
