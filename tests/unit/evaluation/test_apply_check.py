from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import Tensor

from tests.houses import tiny_house
from vlnhijack.errors import CheckError
from vlnhijack.evaluation.apply_check import (
    check_other_samples,
    check_same_samples,
    check_texels,
)
from vlnhijack.scenes.house import House
from vlnhijack.threat import Texture, quantise, violation

OBJECT, EPSILON, SEEDS = "cabinet_0", 0.3, 8


@pytest.fixture(scope="module")
def house() -> House:
    return tiny_house()


@pytest.fixture
def original(house: House) -> Texture:
    return house.surface(OBJECT).texture


@pytest.fixture
def exported(original: Texture) -> Texture:
    return quantise(original + np.float32(EPSILON), original, EPSILON)


def test_exported_texels_inside_the_budget_pass(
    house: House, original: Texture, exported: Texture
) -> None:
    attacked = house.with_texture(OBJECT, exported)
    excess = check_texels(attacked, OBJECT, exported, original, EPSILON)
    assert excess == violation(exported, original, EPSILON) <= 0


def test_one_changed_texel_fails(house: House, original: Texture, exported: Texture) -> None:
    changed = exported.copy()
    changed[3, 4, 1] -= np.float32(1 / 255)
    with pytest.raises(CheckError, match=r"1 texels of cabinet_0 on disk differ"):
        check_texels(house.with_texture(OBJECT, changed), OBJECT, exported, original, EPSILON)


def test_a_texture_of_another_size_fails(
    house: House, original: Texture, exported: Texture
) -> None:
    surfaces = tuple(
        replace(surface, texture=exported[::2, ::2]) if surface.object_id == OBJECT else surface
        for surface in house.surfaces
    )
    smaller = replace(house, surfaces=surfaces)
    with pytest.raises(CheckError, match=r"cabinet_0 on disk is \(32, 32, 3\), exported was"):
        check_texels(smaller, OBJECT, exported, original, EPSILON)


def test_a_texture_outside_the_budget_fails(
    house: House, original: Texture, exported: Texture
) -> None:
    attacked = house.with_texture(OBJECT, exported)
    with pytest.raises(CheckError, match=r"exceeds ε = 0\.29"):
        check_texels(attacked, OBJECT, exported, original, 0.29)


def images(seed: int, noise: float = 0.02) -> Tensor:
    """Two views of 24 × 32 pixels: one scene, whose left half has Monte-Carlo noise."""
    scene = torch.rand(2, 3, 24, 32, generator=torch.Generator().manual_seed(0))
    drawn = noise * torch.randn(2, 3, 24, 32, generator=torch.Generator().manual_seed(seed))
    drawn[..., 16:] = 0
    return scene + drawn


def test_same_samples_may_differ_by_half_a_level() -> None:
    ours = images(1)
    theirs = ours.clone()
    theirs[0, 1, 2, 3] += 0.4 / 255
    assert check_same_samples(ours, theirs) == pytest.approx(0.4 / 255, rel=1e-3)
    theirs[1, 2, 3, 4] -= 1 / 255
    with pytest.raises(CheckError, match=r"differ by 1\.00/255"):
        check_same_samples(ours, theirs)
    theirs[1, 2, 3, 4] = torch.nan
    with pytest.raises(CheckError):
        check_same_samples(ours, theirs)


def stacks(first: int) -> list[Tensor]:
    return [images(seed) for seed in range(first, first + SEEDS)]


@pytest.mark.parametrize("first", range(100, 1100, 100))
def test_other_samples_of_the_same_scene_pass(first: int) -> None:
    smallest, tests = check_other_samples(stacks(first), stacks(first + 50))
    assert tests == 2 * 3 * (24 // 8) * (16 // 8), "the tiles of the noisy half"
    assert 0.01 / tests / 2 < smallest < 1


def test_a_biased_tile_fails() -> None:
    theirs = stacks(200)
    for stack in theirs:
        stack[1, 0, 8:16, :8] += 0.02
    with pytest.raises(CheckError, match=r"images at other samples differ"):
        check_other_samples(stacks(100), theirs)


def test_a_noise_free_tile_may_not_differ() -> None:
    theirs = stacks(200)
    for stack in theirs:
        stack[0, 0, :8, 24:] += 1e-3
    with pytest.raises(CheckError, match=r"noise-free tiles differ by 0\.001"):
        check_other_samples(stacks(100), theirs)
    assert check_other_samples([images(0, noise=0.0)] * SEEDS, [images(1, noise=0.0)] * SEEDS) == (
        1.0,
        0,
    )
