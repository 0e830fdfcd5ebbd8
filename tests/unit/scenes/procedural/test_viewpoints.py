import networkx as nx
import numpy as np

from tests.unit.scenes.procedural.conftest import Sketch
from vlnhijack.scenes.procedural.viewpoints import distance_to_boxes


def test_spacing_and_number(sketch: Sketch) -> None:
    positions = sketch.graph.positions
    gaps = np.linalg.norm(positions[:, None] - positions, axis=-1)
    np.fill_diagonal(gaps, np.inf)
    assert 32 <= len(positions) <= 44
    assert gaps.min() >= 1.5 - 1e-9
    assert gaps.min(axis=1).max() <= 2.5
    assert gaps[sketch.graph.adjacency].max() <= 2.9
    assert (positions[:, 2] == 1.5).all()


def test_connected_with_few_neighbours(sketch: Sketch) -> None:
    degrees = sketch.graph.adjacency.sum(axis=0)
    assert nx.is_connected(sketch.graph.graph)
    assert len(sketch.graph.graph) == len(sketch.graph.viewpoints)
    assert degrees.max() <= 7
    assert 2 <= degrees.mean() <= 5
    assert (sketch.graph.adjacency == sketch.graph.adjacency.T).all()


def test_ids_look_like_matterport(sketch: Sketch) -> None:
    ids = sketch.graph.viewpoints
    assert len(set(ids)) == len(ids)
    assert all(len(name) == 32 and int(name, 16) >= 0 for name in ids)


def test_every_room_has_a_viewpoint(sketch: Sketch) -> None:
    x, y, _ = sketch.graph.positions.T
    for room in sketch.house.rooms:
        x0, y0, x1, y1 = room.bounds
        assert ((x0 < x) & (x < x1) & (y0 < y) & (y < y1)).any()


def test_nobody_stands_in_furniture(sketch: Sketch) -> None:
    boxes = np.array([p.box[[0, 1, 3, 4]] for p in sketch.placements if p.blocks])
    assert distance_to_boxes(sketch.graph.positions[:, :2], boxes).min() >= 0.25


def test_steps_are_in_line_of_sight(sketch: Sketch) -> None:
    positions = sketch.graph.positions
    start, end = np.nonzero(np.triu(sketch.graph.adjacency))
    step = positions[end] - positions[start]
    length = np.linalg.norm(step, axis=1)
    for z in (0.3, 1.0, 1.5):
        origins = positions[start] * (1, 1, 0) + (0, 0, z)
        places, rays, _ = sketch.mesh.ray.intersects_location(
            origins, step / length[:, None], multiple_hits=False
        )
        assert (np.linalg.norm(places - origins[rays], axis=1) > length[rays]).all()


def test_distance_to_boxes() -> None:
    boxes = np.array([[0.0, 0.0, 1.0, 1.0], [5.0, 0.0, 6.0, 1.0]])
    points = [(0.5, 0.5), (2.0, 0.5), (4.0, 2.0)]
    assert np.allclose(distance_to_boxes(points, boxes), [0.0, 1.0, np.sqrt(2)])
    assert np.isinf(distance_to_boxes(points, np.zeros((0, 4)))).all()
