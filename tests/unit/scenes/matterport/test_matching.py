"""Objects are found on another triangulation of the same surfaces."""

import numpy as np
import pytest
import trimesh

from vlnhijack.scenes.matterport.matching import match_objects


def nothing(count: int) -> None:
    pass


def boxes(edge: float) -> tuple[np.ndarray, np.ndarray]:
    """A room and three boxes that touch its floor and walls and each other; corners and objects."""
    room = trimesh.creation.box((4, 3, 2.5)).apply_translation((0, 0, 1.25))
    room.invert()
    places = [(-1.5, -1.0, 0.5), (-0.5, -1.0, 0.5), (1.9, 0.0, 1.0)]
    things = [room] + [trimesh.creation.box((1, 1, 1)).apply_translation(p) for p in places]
    corners, owner = [], []
    for number, thing in enumerate(things):
        vertices, faces = trimesh.remesh.subdivide_to_size(thing.vertices, thing.faces, edge)
        corners.append(vertices[faces])
        owner.append(np.full(len(faces), number - 1, np.int32))
    return np.concatenate(corners), np.concatenate(owner)


def test_the_same_faces_in_another_order_match_exactly() -> None:
    corners, owner = boxes(10.0)
    order = np.random.default_rng(0).permutation(len(corners))
    found, quality = match_objects(corners[order], owner[order], corners, nothing)
    assert np.array_equal(found, owner)
    assert quality.within_reach == 1
    assert quality.high == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(("edge", "other"), [(0.1, 0.17), (0.3, 0.08), (0.08, 0.5), (10.0, 0.1)])
def test_other_triangles_match(edge: float, other: float) -> None:
    segmented, object_of = boxes(edge)
    faces, owner = boxes(other)
    noise = np.random.default_rng(0).normal(0, 0.001, (len(segmented), 1, 3))
    found, quality = match_objects(segmented + noise, object_of, faces, nothing)
    assert (found == owner).mean() > 0.97
    assert quality.within_reach > 0.999
    assert quality.median < 0.003


def test_what_is_far_from_every_segment_has_no_object() -> None:
    corners, owner = boxes(0.5)
    kept = owner != 1
    found, quality = match_objects(corners[kept], owner[kept], corners, nothing)
    centres = corners.mean(1)
    top = ~kept & (centres[:, 2] > 0.99) & (np.abs(centres[:, :2] + [0.5, 1.0]).max(1) < 0.35)
    assert top.any()
    assert (found[top] == -1).all()
    assert quality.within_reach < 1
