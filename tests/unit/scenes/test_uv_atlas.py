"""The atlas keeps charts apart, and rasterisation finds exactly the texels that weigh on a face."""

import numpy as np
import pytest
import trimesh

from vlnhijack.errors import InputError
from vlnhijack.scenes import uv_atlas

MESHES = {
    "box": trimesh.creation.box((1.0, 0.5, 0.3)),
    "sphere": trimesh.creation.icosphere(2),
    "shelf": trimesh.util.concatenate(
        [
            trimesh.creation.box((0.8, 0.3, 0.02)).apply_translation((0, 0, 0.3 * i))
            for i in range(9)
        ]
    ),
}


def _charts(faces: np.ndarray, count: int) -> list[np.ndarray]:
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]])
    groups = trimesh.graph.connected_components(edges, nodes=np.arange(count))
    return [faces[np.isin(faces[:, 0], group)] for group in groups]


@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("resolution", [64, 256])
def test_no_texel_weighs_on_two_charts_and_no_faces_overlap(name: str, resolution: int) -> None:
    mesh = MESHES[name]
    atlas = uv_atlas.unwrap(mesh.vertices, mesh.faces, resolution)
    assert np.array_equal(mesh.vertices[atlas.source][atlas.faces], mesh.vertices[mesh.faces])
    assert 0 <= atlas.uv.min() and atlas.uv.max() <= 1
    charts = _charts(atlas.faces, len(atlas.uv))
    uses = sum(
        uv_atlas.used_texels(atlas.uv, chart, resolution, resolution).astype(int)
        for chart in charts
    )
    assert len(charts) > 1 and uses.max() == 1
    assert not uv_atlas.has_overlap(atlas.uv, atlas.faces, resolution)


def test_unwrapping_is_deterministic() -> None:
    mesh = MESHES["sphere"]
    first, second = (uv_atlas.unwrap(mesh.vertices, mesh.faces, 128) for _ in range(2))
    assert np.array_equal(first.uv, second.uv) and np.array_equal(first.faces, second.faces)


def test_too_small_a_texture_is_an_input_error() -> None:
    mesh = MESHES["shelf"]
    with pytest.raises(InputError, match="resolution"):
        uv_atlas.unwrap(mesh.vertices, mesh.faces, 8)


def test_used_texels_are_those_with_bilinear_weight_on_a_dense_sample_of_points() -> None:
    rng = np.random.default_rng(0)
    uv, faces = rng.random((3, 2)), np.array([[0, 1, 2]])
    height, width = 17, 23
    points = rng.dirichlet((0.4, 0.4, 0.4), 400_000) @ (uv * [width, height] - 0.5)
    expected = np.zeros((height, width), bool)
    base = np.floor(points).astype(int)
    for dx in (0, 1):
        for dy in (0, 1):
            x, y = np.clip(base + [dx, dy], 0, [width - 1, height - 1]).T
            expected[y, x] = True
    used = uv_atlas.used_texels(uv, faces, height, width)
    assert not (expected & ~used).any()
    assert (used & ~expected).sum() <= 2


def test_rasterise_gives_each_used_texel_once_with_its_nearest_point() -> None:
    mesh = MESHES["sphere"]
    size = 96
    atlas = uv_atlas.unwrap(mesh.vertices, mesh.faces, size)
    texels = uv_atlas.rasterise(atlas.uv, atlas.faces, size, size)
    mask = uv_atlas.used_texels(atlas.uv, atlas.faces, size, size)
    assert len(texels.rows) == mask.sum() and mask[texels.rows, texels.columns].all()
    assert np.allclose(texels.barycentric.sum(1), 1) and texels.barycentric.min() >= 0
    corners = (atlas.uv.astype(float) * size - 0.5)[atlas.faces]
    points = np.einsum("kc,kcd->kd", texels.barycentric, corners[texels.face])
    gaps = np.linalg.norm(points - np.stack([texels.columns, texels.rows], 1), axis=1)
    assert gaps.max() < np.sqrt(2)
    for row in range(0, len(gaps), 97):
        centre = np.array([[texels.columns[row], texels.rows[row], 0.0]])
        flat = np.concatenate([corners, np.zeros((len(corners), 3, 1))], 2)
        nearest = trimesh.triangles.closest_point(flat, np.repeat(centre, len(flat), 0))
        assert gaps[row] == pytest.approx(np.linalg.norm(nearest - centre, axis=1).min(), abs=1e-6)


def test_dilate_copies_the_nearest_used_texel() -> None:
    texture = np.zeros((5, 5, 3), np.float32)
    texture[2, 0], texture[2, 4] = 0.25, 0.75
    mask = np.zeros((5, 5), bool)
    mask[2, 0] = mask[2, 4] = True
    filled = uv_atlas.dilate(texture, mask)
    assert (filled[:, :2] == 0.25).all() and (filled[:, 3:] == 0.75).all()


def test_overlap_is_found_and_touching_is_none() -> None:
    square = np.array([[0.1, 0.1], [0.9, 0.1], [0.9, 0.9], [0.1, 0.9], [0.5, 0.55]])
    split = np.array([[0, 1, 2], [0, 2, 3]])
    assert not uv_atlas.has_overlap(square, split, 64)
    assert uv_atlas.has_overlap(square, np.array([[0, 1, 2], [0, 1, 4], [0, 2, 3]]), 64)
    assert uv_atlas.has_overlap(square, np.array([[0, 1, 2], [0, 1, 2]]), 64)
