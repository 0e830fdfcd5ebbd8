"""Generated graphs stand on bare floor, clear of furniture, and go through no wall."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from tests.source_room import furnished_room
from vlnhijack.errors import InputError
from vlnhijack.scenes.importing.free_space import free_space, make_walking_graph

BOX, BALL = (0.6, 0.7, 1.4, 1.3), (3.0, 2.0, 0.4)


def test_viewpoints_stand_clear() -> None:
    graph = make_walking_graph(furnished_room(), "made", 0)
    assert len(graph.viewpoints) >= 3
    assert np.isfinite(graph.distances).all()
    assert np.allclose(graph.positions[:, 2], 1.5)
    x, y = graph.positions[:, 0], graph.positions[:, 1]
    assert ((x > 0.2) & (x < 3.8) & (y > 0.2) & (y < 2.8)).all()
    away = np.hypot(
        np.maximum(np.maximum(BOX[0] - x, x - BOX[2]), 0),
        np.maximum(np.maximum(BOX[1] - y, y - BOX[3]), 0),
    )
    assert (away > 0.14).all()
    assert (np.hypot(x - BALL[0], y - BALL[1]) > BALL[2] + 0.1).all()


def test_thin_walls_stop_people() -> None:
    source = furnished_room()
    wall = np.array([[2, 0, 0], [2, 3, 0], [2, 3, 2.5], [2, 0, 2.5]], float)
    mesh = trimesh.Trimesh(
        np.concatenate([source.vertices, wall]),
        np.concatenate([source.faces, len(source.vertices) + np.array([[0, 1, 2], [0, 2, 3]])]),
        process=False,
    )
    places = free_space(mesh, "room.glb").places
    assert (places[:, 0] < 2).all() or (places[:, 0] > 2).all()


def test_no_room_is_said() -> None:
    source = furnished_room()
    with pytest.raises(InputError, match="free space"):
        make_walking_graph(replace(source, vertices=source.vertices * 0.3), "made", 0)
