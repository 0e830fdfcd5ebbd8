"""The loss at other camera rays than the attack's own."""

import pytest

from vlnhijack.experiments.overfitting import loss_gap


def test_the_gap_is_what_the_loss_at_own_rays_understates() -> None:
    losses = {7: 2.0, 1: 2.5, 2: 2.25, 3: 2.75}
    assert loss_gap(losses.__getitem__, 7, 1, 2, 3) == pytest.approx(
        {"loss_own_rays": 2.0, "loss_other_rays": 2.5, "deviation": 0.25, "gap": 0.25}
    )
    assert loss_gap(lambda seed: 0.0, 7, 1, 2)["gap"] == 0


def test_without_rays_of_its_own_an_attack_has_no_gap() -> None:
    asked: list[int] = []

    def loss(seed: int) -> float:
        asked.append(seed)
        return float(seed)

    assert loss_gap(loss, None, 1, 3) == {
        "loss_own_rays": None,
        "loss_other_rays": 2.0,
        "deviation": pytest.approx(2**0.5),
        "gap": None,
    }
    assert asked == [1, 3]
