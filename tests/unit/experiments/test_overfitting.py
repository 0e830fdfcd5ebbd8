"""The loss at other camera rays than the attack's own."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch

from vlnhijack.attack.attacked_views import AttackedViews
from vlnhijack.experiments import overfitting
from vlnhijack.experiments.config import RenderSettings
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


class _Shown:
    """A renderer, whose views are the texture, and an objective."""

    cameras, first = ("camera",), (0,)

    def __call__(self, *given: Any) -> torch.Tensor:
        return given[0]


@pytest.mark.parametrize(
    ("settings", "built"),
    [
        (RenderSettings(), [8]),
        (RenderSettings(rung="fixed-illumination", refresh_every=2), [7, 8]),
    ],
)
def test_the_attacks_own_operator_is_built_once(
    monkeypatch: pytest.MonkeyPatch, settings: RenderSettings, built: list[int]
) -> None:
    found: list[int] = []

    def renderer(*given: Any) -> _Shown:
        found.append(given[-1])
        return _Shown()

    at = torch.tensor([0])
    views = AttackedViews(_Shown(), lambda images: images, torch.zeros(1, 36, 3), at, at)
    monkeypatch.setattr(overfitting, "attack_renderer", renderer)
    monkeypatch.setattr(overfitting, "training", lambda *given: (views, _Shown()))
    monkeypatch.setattr(overfitting, "exported_texture", lambda *given: np.ones((1, 3), np.float32))
    instance = SimpleNamespace(scan="alder", object_id="sofa_0")
    house = SimpleNamespace(with_texture=lambda *given: None)
    loss = overfitting._loss(
        SimpleNamespace(houses={"alder": house}),
        SimpleNamespace(instance=instance, rendering=settings),
        7,
    )
    assert loss(7) == loss(8) == pytest.approx(1 / 36)
    assert found == built
