import numpy as np
import pytest

from tests.box_house import blocked, box_house, objects, walls
from vlnhijack.scenes.procedural.landmarks import box_gap, find_landmarks

HOUSE = box_house()
LANDMARKS = find_landmarks(HOUSE)
BOXES = {name: box for name, (_, _, box) in objects().items()}


def share_in_sight(viewpoint: str, name: str) -> float:
    """Share of a grid of points just inside an object's box that no other box hides."""
    eye = HOUSE.graph.positions[HOUSE.graph.row(viewpoint)]
    x0, y0, x1, y1, height = BOXES[name]
    corners = [np.linspace(a, b, 4) for a, b in ((x0, x1), (y0, y1), (0.01, height))]
    points = np.stack(np.meshgrid(*corners), axis=-1).reshape(-1, 3)
    others = [*walls(), *(box for other, box in BOXES.items() if other != name)]
    return float(np.mean([not any(blocked(eye, p, box) for box in others) for p in points]))


@pytest.mark.parametrize("viewpoint", HOUSE.graph.viewpoints[::5])
def test_sightings_are_the_objects_in_line_of_sight(viewpoint: str) -> None:
    seen = LANDMARKS.sightings[viewpoint]
    for name in BOXES:
        share = share_in_sight(viewpoint, name)
        if name in seen:
            assert share > 0.15, name
        elif share > 0.75:
            position = HOUSE.graph.positions[HOUSE.graph.row(viewpoint)]
            thing = HOUSE.object(name)
            far = np.linalg.norm(np.asarray(thing.centre) - position)
            assert np.linalg.norm(thing.size) / far < 0.15, name


def test_a_sighting_measures_from_the_viewpoint_to_the_footprint() -> None:
    for viewpoint, seen in LANDMARKS.sightings.items():
        x, y, _ = HOUSE.graph.positions[HOUSE.graph.row(viewpoint)]
        for name, sighting in seen.items():
            x0, y0, x1, y1, _ = BOXES[name]
            nearest = (np.clip(x, x0, x1), np.clip(y, y0, y1))
            assert sighting.distance == pytest.approx(np.hypot(x - nearest[0], y - nearest[1]))
            heading = np.arctan2((x0 + x1) / 2 - x, (y0 + y1) / 2 - y)
            assert np.cos(sighting.heading - heading) == pytest.approx(1)


def test_every_viewpoint_has_the_room_around_it() -> None:
    for viewpoint, room in LANDMARKS.rooms.items():
        x, y, _ = HOUSE.graph.positions[HOUSE.graph.row(viewpoint)]
        x0, y0, x1, y1 = room.bounds
        assert x0 <= x <= x1 and y0 <= y <= y1


def test_the_gap_between_boxes() -> None:
    one = np.array([0.0, 0.0, 1.0, 1.0])
    assert box_gap(one, np.array([4.0, 5.0, 6.0, 6.0])) == pytest.approx(5.0)
    assert box_gap(one, np.array([0.5, 3.0, 0.7, 4.0])) == pytest.approx(2.0)
    assert box_gap(one, np.array([0.5, 0.5, 3.0, 3.0])) == 0.0
