"""The map shows walls, both arms and the target; lanes never share a line."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.houses import tiny_house
from vlnhijack.errors import InputError
from vlnhijack.report.floor_map import WALL_COLOUR
from vlnhijack.report.style import ATTACKED, CLEAN, HIGHLIGHT, TARGET
from vlnhijack.report.trajectory_map import Lanes, trajectory_map
from vlnhijack.threat import AttackInstance

HOUSE = tiny_house()
A, B, C, D = HOUSE.graph.viewpoints


def instance(*trajectory: str, object_id: str = "cabinet_0") -> AttackInstance:
    return AttackInstance("tiny", HOUSE.name, object_id, "cabinet", A, 0.5, trajectory, (), (), ())


def count(path: Path, colour: str) -> int:
    """Pixels of a map within a few levels of a colour, the legend left out."""
    pixels = np.asarray(Image.open(path).convert("RGB")).astype(int)[:-200]
    wanted = [int(colour[at : at + 2], 16) for at in (1, 3, 5)]
    return int((np.abs(pixels - wanted).max(axis=2) <= 6).sum())


def test_every_part_is_drawn(tmp_path: Path) -> None:
    path = tmp_path / "map.png"
    trajectory_map(path, HOUSE, instance(B, C), [[A, D, C]] * 3, [[A, B, C]] * 2 + [[A, D]])
    for colour in (CLEAN, ATTACKED, TARGET, HIGHLIGHT, WALL_COLOUR):
        assert count(path, colour) > 300, colour
    assert path.stat().st_size < 300_000


def test_wider_where_walked_more(tmp_path: Path) -> None:
    few, many = tmp_path / "few.png", tmp_path / "many.png"
    trajectory_map(few, HOUSE, instance(), [[A, D, C]] + [[A]] * 9, [[A]])
    trajectory_map(many, HOUSE, instance(), [[A, D, C]] * 9 + [[A]], [[A]])
    assert count(many, CLEAN) > 1.5 * count(few, CLEAN)


def test_stop_sign_without_a_trajectory(tmp_path: Path) -> None:
    path = tmp_path / "map.png"
    trajectory_map(path, HOUSE, instance(), [[A, B]], [[A]])
    assert count(path, TARGET) > 300


def test_the_same_twice(tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        trajectory_map(tmp_path / name, HOUSE, instance(B, C), [[A, D]], [[A, B], [A, D, A]])
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_unknown_names_leave_no_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="viewpoint"):
        trajectory_map(tmp_path / "a.png", HOUSE, instance(), [[A, "nowhere"]], [])
    with pytest.raises(InputError, match="object"):
        trajectory_map(tmp_path / "a.png", HOUSE, instance(object_id="sofa_9"), [], [])
    assert not list(tmp_path.iterdir())


def test_lanes_of_two_arms_lie_on_either_side_of_the_edge() -> None:
    left, right = Lanes(HOUSE.graph, A, 0.1), Lanes(HOUSE.graph, A, -0.1)
    for here, there in pairwise([A, D, C, B, A]):
        assert left.offset(here, there) == pytest.approx(left.offset(there, here))
        assert left.offset(here, there) == pytest.approx(-right.offset(here, there))
    assert left.offset(A, B) == pytest.approx([0, 0.1])  # A → B leads along +x
    start, stop = left.edge(A, B)
    assert start == pytest.approx([-1.2 + 0.22, -1.1]) and stop == pytest.approx([1.2 - 0.22, -1.1])


def test_turns_join_the_lanes() -> None:
    lanes = Lanes(HOUSE.graph, A, 0.1)
    curve = lanes.turn(A, D, C).vertices
    assert curve[0] == pytest.approx(lanes.edge(A, D)[1])
    assert curve[2] == pytest.approx(lanes.edge(D, C)[0])
    assert curve[1] == pytest.approx([-1.3, 1.3])  # the mitre of the outer corner
