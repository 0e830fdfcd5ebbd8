import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from vlnhijack.navigation.episode import Episode
from vlnhijack.threat import AttackInstance, Texture, bounds, guide, project, quantise, violation

SHAPE = (3, 4, 3)
SLACK = 1e-6
levels = arrays(np.uint8, SHAPE, elements=st.integers(0, 255))
wanted = arrays(np.float32, SHAPE, elements=st.floats(-0.5, 1.5, width=32))
epsilons = st.one_of(
    st.floats(0, 1), st.integers(0, 255).map(lambda k: k / 255), st.floats(0, 1e-6)
)


def display(eight_bit: np.ndarray) -> Texture:
    return eight_bit.astype(np.float32) / np.float32(255)


@settings(max_examples=60, deadline=None)
@given(levels, wanted, epsilons)
def test_a_projected_texture_is_the_nearest_inside(
    eight_bit: np.ndarray, texture: Texture, epsilon: float
) -> None:
    original = display(eight_bit)
    projected = project(texture, original, epsilon)
    assert violation(projected, original, epsilon) <= SLACK
    assert projected.min() >= 0
    assert projected.max() <= 1
    lower, upper = bounds(original, epsilon)
    inside = (texture >= lower) & (texture <= upper)
    assert (projected == texture)[inside].all()
    edge = np.where(texture > original, upper, lower)
    assert (projected == edge)[~inside].all()
    assert (project(projected, original, epsilon) == projected).all()


@settings(max_examples=60, deadline=None)
@given(levels, wanted, epsilons)
def test_a_quantised_texture_is_the_nearest_8_bit_one_inside(
    eight_bit: np.ndarray, texture: Texture, epsilon: float
) -> None:
    original = display(eight_bit)
    quantised = quantise(texture, original, epsilon)
    stored = np.rint(quantised.astype(np.float64) * 255)
    assert (quantised == display(stored)).all()
    assert violation(quantised, original, epsilon) <= SLACK
    assert (quantise(quantised, original, epsilon) == quantised).all()
    reach = np.floor(epsilon * 255 + 1e-4)
    low, high = np.maximum(eight_bit - reach, 0), np.minimum(eight_bit + reach, 255)
    assert (stored == np.clip(np.rint(texture.astype(np.float64) * 255), low, high)).all()


@pytest.mark.parametrize("value", [0.0, 1.0], ids=["black", "white"])
def test_black_and_white_textures_move_one_way(value: float) -> None:
    original = np.full(SHAPE, value, np.float32)
    for target in (0.0, 1.0):
        moved = quantise(np.full(SHAPE, target, np.float32), original, 0.3)
        expected = value if target == value else abs(value - 76 / 255)
        assert moved == pytest.approx(np.full(SHAPE, expected), abs=1e-7)


def test_violation_is_how_far_the_largest_change_exceeds_epsilon() -> None:
    original = np.full(SHAPE, 0.5, np.float32)
    changed = original.copy()
    changed[1, 2, 0] = 0.125
    assert violation(changed, original, 0.3) == pytest.approx(0.075)
    assert violation(changed, original, 0.4) == pytest.approx(-0.025)
    assert violation(original, original, 0.0) == 0


@pytest.mark.parametrize("trajectory", [(), ("d",)])
def test_an_instance_knows_its_kind_and_guides(trajectory: tuple[str, ...]) -> None:
    episode = Episode(1, "scan", ("a", "b", "c", "b"), 0.0, "go", "1_0", 3.0)
    instance = AttackInstance("i", "scan", "o", "chair", "b", 0.5, trajectory, (), (), ())
    assert instance.kind == ("trajectory" if trajectory else "single_step")
    assert instance.target_path == ["b", *trajectory]
    assert guide(instance, episode) == ["a", "b"]
