from collections import Counter
from itertools import combinations

import numpy as np

from tests.unit.scenes.procedural.conftest import Sketch
from vlnhijack.scenes.procedural.floor_plan import make_floor_plan
from vlnhijack.scenes.procedural.furniture import ATTACKABLE
from vlnhijack.scenes.procedural.room_layout import RoomLayout


def test_enough_pieces_of_every_kind(sketch: Sketch) -> None:
    counts = Counter(o.category for o in sketch.house.objects)
    assert counts.total() >= 25
    assert all(counts[category] >= 2 for category in ATTACKABLE)
    assert len(set(counts) - set(ATTACKABLE)) >= 4
    assert any(p.large for p in sketch.placements)


def test_pieces_stay_in_their_room_and_do_not_meet(sketch: Sketch) -> None:
    for placement in sketch.placements:
        x0, y0, x1, y1 = sketch.house.rooms[placement.room].bounds
        box = placement.box
        assert x0 <= box[0] and y0 <= box[1] and box[3] <= x1 and box[4] <= y1
        exact = placement.vertices
        assert np.allclose(np.r_[exact.min(axis=0), exact.max(axis=0)], box, atol=1e-6)
    for a, b in combinations(sketch.placements, 2):
        if "rug" in (a.piece.category, b.piece.category):
            continue
        overlap = np.minimum(a.box[3:], b.box[3:]) - np.maximum(a.box[:3], b.box[:3])
        seats = {a.piece.category, b.piece.category} in ({"chair", "table"}, {"chair", "desk"})
        assert overlap.min() <= (0.13 if seats else 1e-9)


def test_wall_piece_stands_with_its_back_to_a_wall() -> None:
    plan = make_floor_plan(np.random.default_rng(1))
    room = RoomLayout(plan, 1, np.random.default_rng(2))
    cabinet = room.against_wall("cabinet")
    assert cabinet is not None
    x0, y0, x1, y1 = room.room.bounds
    ahead = np.array([np.sin(cabinet.heading), np.cos(cabinet.heading)])
    back = np.array(cabinet.position[:2]) - ahead * cabinet.piece.size[1] / 2
    assert min(back[0] - x0, x1 - back[0], back[1] - y0, y1 - back[1]) < 0.05
    middle = np.array([(x0 + x1) / 2, (y0 + y1) / 2])
    assert (middle - back) @ ahead > 0


def test_a_full_room_takes_no_more_and_stays_walkable() -> None:
    plan = make_floor_plan(np.random.default_rng(1))
    room = RoomLayout(plan, 1, np.random.default_rng(2))
    while room.against_wall("sofa", large=True) is not None:
        assert len(room.placed) < 10
    assert all(p.blocks for p in room.placed)
    for doorway in plan.doorways_of(1):
        way = np.array(doorway.position)
        for placement in room.placed:
            low, high = placement.box[:2], placement.box[3:5]
            assert np.linalg.norm(np.maximum(np.maximum(low - way, way - high), 0)) > 0.5
