import numpy as np
import pytest
import trimesh

from vlnhijack.scenes.procedural.floor_plan import make_floor_plan
from vlnhijack.scenes.procedural.walls import TEXEL, Panel, pane, room_shell, shell
from vlnhijack.scenes.uv_atlas import has_overlap


def test_panel_with_a_hole_faces_its_sign_and_leaves_the_hole_open() -> None:
    hole = ((0.0, 1.0, 0.0), (0.0, 2.0, 2.0))
    for sign in (-1, 1):
        mesh = shell([Panel(0, sign, (0.0, 0.0, 0.0), (0.0, 4.0, 3.0), "wall", (hole,))])
        corners = mesh.vertices[mesh.faces]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
        assert normal.sum(axis=0) == pytest.approx([sign * 10.0, 0.0, 0.0])
        assert (normal[:, 0] * sign > 0).all()


@pytest.mark.parametrize("seed", range(3))
def test_charts_do_not_overlap_and_fit(seed: int) -> None:
    plan = make_floor_plan(np.random.default_rng(seed))
    for room in range(len(plan.rooms)):
        mesh = room_shell(plan, room)
        assert max(mesh.height, mesh.width) <= 1024
        assert mesh.uv.min() >= 0 and mesh.uv.max() <= 1
        assert not has_overlap(mesh.uv, mesh.faces, max(mesh.height, mesh.width))


def test_floor_has_the_texel_size() -> None:
    plan = make_floor_plan(np.random.default_rng(0))
    mesh = room_shell(plan, 0)
    floor = mesh.faces[mesh.face_material == mesh.materials.index("floor")]
    metres = np.ptp(mesh.vertices[floor.ravel()], axis=0)[:2]
    pixels = np.ptp(mesh.uv[floor.ravel()], axis=0) * (mesh.width, mesh.height)
    assert metres / pixels == pytest.approx([TEXEL, TEXEL], rel=0.01)


@pytest.mark.parametrize("seed", range(3))
def test_inside_every_ray_meets_a_front_or_a_pane(seed: int) -> None:
    plan = make_floor_plan(np.random.default_rng(seed))
    shells = [room_shell(plan, room) for room in range(len(plan.rooms))]
    mesh = trimesh.util.concatenate(
        [trimesh.Trimesh(s.vertices, s.faces, process=False) for s in shells]
    )
    rng = np.random.default_rng(seed)
    x0, y0, x1, y1 = plan.rooms[seed].bounds
    low, high = (x0 + 0.1, y0 + 0.1, 0.1), (x1 - 0.1, y1 - 0.1, plan.height - 0.1)
    origins = rng.uniform(low, high, (4000, 3))
    directions = rng.normal(size=(4000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    hits = mesh.ray.intersects_first(origins, directions)
    facing = np.einsum("kd,kd->k", mesh.face_normals[hits[hits >= 0]], directions[hits >= 0])
    assert (facing < 0).mean() > 0.999
    leaves = [
        any(_passes(origin, ray, *pane(plan, window), window.axis) for window in plan.windows)
        for origin, ray in zip(origins[hits < 0], directions[hits < 0], strict=True)
    ]
    assert np.mean(leaves) > 0.98


def _passes(
    origin: np.ndarray, ray: np.ndarray, low: tuple[float, ...], high: tuple[float, ...], axis: int
) -> bool:
    distance = (low[axis] - origin[axis]) / ray[axis]
    point = origin + distance * ray
    point[axis] = low[axis]
    return bool(
        distance > 0
        and (point >= np.array(low) - 1e-6).all()
        and (point <= np.array(high) + 1e-6).all()
    )
