import numpy as np
import pytest

from vlnhijack.scenes.procedural import shapes
from vlnhijack.scenes.procedural.shapes import Mesh

SOLIDS = {
    "box": shapes.box(1.0, 2.0, 3.0, at=(5.0, 0.0, 1.0)),
    "taper": shapes.taper((0.1, 0.1), (0.3, 0.2), 0.5, lean=(0.1, 0.0)),
    "cushion": shapes.cushion(1.0, 0.8, 0.2, 0.05, crown=0.03),
    "cylinder": shapes.cylinder(0.5, 2.0, sides=64),
    "vessel": shapes.lathe([(0.5, 0.0), (0.5, 1.0), (0.4, 1.0), (0.4, 0.1)], 24),
    "ball": shapes.ball(0.5, (0.0, 0.0, 0.0), 24),
    "bar": shapes.bar((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), 0.1),
    "arch": shapes.sweep([(0, 0, 0), (0, 0.5, 1), (0, 1, 1), (0, 1.5, 0)], 0.05),
    "shell": shapes.shell(shapes.rectangle(2.0, 1.0, 0.0, 0.1), 0.1, 0.5, 0.1),
    "mirrored": shapes.box(1.0, 1.0, 1.0, at=(2.0, 0.0, 0.0)).mirrored(),
    "ring": shapes.loft(
        [shapes.circle(r, z, 12) for r, z in ((1, 0), (1, 1), (0.5, 1), (0.5, 0))], cyclic=True
    ),
}


def volume(mesh: Mesh) -> float:
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    return float(np.einsum("fi,fi->", a, np.cross(b, c)) / 6)


def directed_edges(mesh: Mesh) -> set[tuple[int, int]]:
    f = mesh.faces
    edges = np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]])
    pairs = {(int(a), int(b)) for a, b in edges}
    assert len(pairs) == len(edges), "an edge is used twice in the same direction"
    return pairs


@pytest.mark.parametrize("name", SOLIDS)
def test_solids_are_closed_and_face_outwards(name: str) -> None:
    edges = directed_edges(SOLIDS[name])
    assert all((b, a) in edges for a, b in edges)
    assert volume(SOLIDS[name]) > 0


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("box", 6.0),
        ("cylinder", np.pi / 2),
        ("vessel", np.pi * (0.25 - 0.16 * 0.9)),
        ("ball", np.pi / 6),
    ],
)
def test_volumes(name: str, expected: float) -> None:
    assert volume(SOLIDS[name]) == pytest.approx(expected, rel=0.04)


def test_transforms_keep_the_volume_and_turn_right_handed() -> None:
    turned = shapes.box(1.0, 2.0, 3.0).turned("z", np.pi / 2)
    assert volume(turned) == pytest.approx(6.0)
    point = Mesh(np.array([[1.0, 0.0, 0.0]]), np.zeros((0, 3), int))
    assert np.allclose(point.turned("z", np.pi / 2).vertices, [[0, 1, 0]])
    assert np.allclose(point.turned("y", np.pi / 2).vertices, [[0, 0, -1]])
    assert np.allclose(point.turned("z", np.pi, about=(2.0, 0.0, 0.0)).vertices, [[3, 0, 0]])


def test_join_keeps_every_face() -> None:
    both = shapes.join([shapes.box(1, 1, 1), shapes.box(1, 1, 1, at=(3.0, 0.0, 0.0))])
    assert volume(both) == pytest.approx(2.0)
    assert both.faces.max() == 15


def test_a_leaf_shows_both_sides() -> None:
    blade = shapes.leaf(0.3, 0.1, 0.5)
    a, b, c = (blade.vertices[blade.faces[:, i]] for i in range(3))
    up = np.cross(b - a, c - a)[:, 2] > 0
    assert up.sum() == (~up).sum()
    assert np.ptp(blade.vertices[:, 0]) == pytest.approx(0.1, rel=0.1)
