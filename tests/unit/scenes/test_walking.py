"""Graphs grow from wherever there is room."""

import numpy as np
import trimesh

from vlnhijack.scenes.walking import FreeSpace, walking_graph


def test_without_doorways_attempts_start_at_different_places() -> None:
    nook = np.array([[20.0, 20.0]])
    hall = np.stack(np.meshgrid(np.arange(0, 6, 0.5), np.arange(0, 6, 0.5)), -1).reshape(-1, 2)
    space = FreeSpace(
        places=np.concatenate([nook, hall]),
        doorways=0,
        clearance=lambda points: np.ones(len(points)),
        mesh=trimesh.creation.box((30, 30, 0.1)),
    )
    graph = walking_graph("hall", 0, space, [], 40, lambda places: len(places) > 1)
    assert graph is not None
    assert (graph.positions[:, 0] < 6).all()
