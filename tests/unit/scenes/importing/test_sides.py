"""No viewpoint sees a black back after `show_sides`."""

from dataclasses import replace

import numpy as np

from tests.source_room import furnished_room, line_graph
from vlnhijack.scenes.importing.sides import seen_sides, show_sides
from vlnhijack.scenes.importing.source_mesh import SourceMesh

POSITIONS = line_graph("made").positions


def backs(source: SourceMesh) -> int:
    return int((seen_sides(source.vertices, source.faces, POSITIONS)[1] > 0).sum())


def turned(source: SourceMesh, rows) -> SourceMesh:
    faces, uv = source.faces.copy(), source.corner_uv.copy()
    faces[rows], uv[rows] = faces[rows][:, ::-1], uv[rows][:, ::-1]
    return replace(source, faces=faces, corner_uv=uv)


def test_a_good_mesh_stays() -> None:
    source = furnished_room()
    shown, sides = show_sides(source, POSITIONS)
    assert (sides.seen_from_back, sides.turned, sides.doubled) == (0, 0, 0)
    assert shown.faces is source.faces or np.array_equal(shown.faces, source.faces)


def test_parts_inside_out_are_turned() -> None:
    source = furnished_room()
    shell = np.flatnonzero(source.face_object == -1)
    shown, sides = show_sides(turned(source, shell), POSITIONS)
    assert sides.turned == len(shell)
    assert np.array_equal(shown.faces, source.faces)


def test_open_parts_get_a_second_side() -> None:
    """A screen between the viewpoints is seen from both sides."""
    source = furnished_room()
    x = 1.2
    corners = np.array([[x, 1.5, 1], [x, 3, 1], [x, 3, 2.2], [x, 1.5, 2.2]])
    first = len(source.vertices)
    screen = first + np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    source = replace(
        source,
        vertices=np.concatenate([source.vertices, corners]),
        faces=np.concatenate([source.faces, screen]),
        corner_uv=np.concatenate([source.corner_uv, np.zeros((2, 3, 2), np.float32)]),
        face_material=np.append(source.face_material, np.int32([3, 3])),
        face_object=np.append(source.face_object, np.int32([-1, -1])),
    )
    assert backs(source) == 2
    shown, sides = show_sides(source, POSITIONS)
    assert sides.doubled == 2
    assert backs(shown) == 0
