from collections.abc import Callable

import numpy as np
import pytest

from vlnhijack.scenes.procedural import materials, surroundings
from vlnhijack.scenes.procedural.art import painting, view
from vlnhijack.scenes.procedural.materials import Material
from vlnhijack.scenes.procedural.noise import fractal, hashed, noise

Maker = Callable[[np.random.Generator], Material]
MAKERS: dict[str, Maker] = {
    "wood": materials.wood,
    "fabric": materials.fabric,
    "leather": materials.leather,
    "metal": materials.metal,
    "leaves": lambda rng: materials.leaves(rng, 0.5, 1.0),
    "ceramic": materials.ceramic,
    "glazed": materials.glazed,
    "marble": materials.marble,
    "speckled": materials.speckled,
    "plaster": surroundings.plaster,
    "wallpaper": surroundings.wallpaper,
    "wainscot": surroundings.wainscot,
    "parquet": surroundings.parquet,
    "tile": surroundings.tile,
    "carpet": surroundings.carpet,
    "rug": lambda rng: surroundings.rug(rng, 2.0, 1.4, False),
    "painting": lambda rng: painting(rng, 1.0, 1.0),
    "view": lambda rng: view(rng, 1.0, 1.0, 0.0),
}


def surface_points(count: int = 500) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(5)
    normals = rng.normal(size=(count, 3))
    return rng.uniform(-1, 1, (count, 3)), normals / np.linalg.norm(normals, axis=1, keepdims=True)


@pytest.mark.parametrize("name", MAKERS)
def test_colours_are_albedos_and_repeat(name: str) -> None:
    points, normals = surface_points()
    for seed in range(6):
        first = MAKERS[name](np.random.default_rng(seed))(points, normals)
        again = MAKERS[name](np.random.default_rng(seed))(points, normals)
        assert first.shape == (500, 3)
        assert np.array_equal(first, again)
        part = MAKERS[name](np.random.default_rng(seed))(points[:7], normals[:7])
        assert np.allclose(first[:7], part), "a colour depends on the other points"
        assert first.min() >= 0.03
        assert first.max() <= 0.95


@pytest.mark.parametrize("name", sorted(set(MAKERS) - {"ceramic"}))
def test_the_generator_decides(name: str) -> None:
    points, normals = surface_points()
    colours = [MAKERS[name](np.random.default_rng(s))(points, normals) for s in range(4)]
    assert any(not np.allclose(colours[0], other) for other in colours[1:])


@pytest.mark.parametrize("pattern", ["plain", "stripes", "plaid", "dots", "damask"])
def test_patterned_fabric_has_contrast(pattern: str) -> None:
    points, normals = surface_points(4000)
    rng = np.random.default_rng(1)
    spread = materials.fabric(rng, pattern=pattern)(points, normals).std(axis=0).max()
    assert (spread > 0.05) == (pattern != "plain")


def test_noise_is_smooth_and_fills_the_unit_interval() -> None:
    points = np.random.default_rng(0).uniform(-50, 50, (20000, 3))
    values = noise(points, 1.0, 3)
    assert values.min() >= 0
    assert values.max() <= 1
    assert abs(values.mean() - 0.5) < 0.02
    assert np.abs(noise(points + 1e-4, 1.0, 3) - values).max() < 1e-3
    assert not np.allclose(values, noise(points, 1.0, 4))
    assert 0 <= fractal(points, 1.0, 3).min() <= fractal(points, 1.0, 3).max() <= 1


def test_hashes_are_uniform_also_for_negative_cells() -> None:
    cells = np.stack(np.meshgrid(*[np.arange(-15, 15)] * 3), axis=-1).reshape(-1, 3)
    counts, _ = np.histogram(hashed(cells, 9), bins=10, range=(0, 1))
    assert counts.sum() == len(cells)
    assert counts.min() > 0.9 * len(cells) / 10
