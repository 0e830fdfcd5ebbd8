"""The scene file says what Mitsuba needs, and points its camera at furniture."""

from xml.etree import ElementTree

import numpy as np
import pytest

from tests.houses import tiny_house
from vlnhijack import frames
from vlnhijack.scenes.mitsuba_xml import default_camera, scene_xml


@pytest.mark.parametrize("kind, raw, depth", [("baked", "true", "1"), ("lit", "false", "6")])
def test_every_surface_is_one_shape_with_a_float_texture(kind, raw, depth) -> None:  # type: ignore[no-untyped-def]
    house = tiny_house(kind)
    scene = ElementTree.fromstring(scene_xml(house))
    shapes = scene.findall("shape[@type='ply']")
    assert [shape.get("id") for shape in shapes] == [s.name for s in house.surfaces]
    for shape in shapes:
        texture = shape.find(".//texture")
        assert texture is not None
        values = {value.get("name"): value.get("value") for value in texture}
        assert values["raw"] == raw and values["format"] == "variant"
        assert values["wrap_mode"] == "clamp" and values["filter_type"] == "bilinear"
    assert scene.find("integrator/integer[@name='max_depth']").get("value") == depth  # type: ignore[union-attr]
    assert len(scene.findall("shape[@type='rectangle']")) == len(house.lights)


def test_the_default_camera_stands_at_a_viewpoint_and_looks_at_an_object() -> None:
    house = tiny_house()
    camera = default_camera(house)
    assert any(np.allclose(camera.position, p) for p in house.graph.positions)
    offsets = np.array([o.centre for o in house.objects]) - camera.position
    angles = frames.wrap(frames.heading_of(offsets) - camera.heading)
    assert (np.abs(angles) < np.pi / 6).any()
