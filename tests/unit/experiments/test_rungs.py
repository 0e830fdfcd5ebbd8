"""Which renderer an experiment's rung stands for, and when its light is renewed."""

import pytest
import torch

from tests.houses import tiny_house
from vlnhijack.attack.projected_adam import ProjectedAdam
from vlnhijack.errors import InputError
from vlnhijack.experiments.attack_stage import _renew
from vlnhijack.experiments.config import RenderSettings
from vlnhijack.experiments.rungs import attack_renderer, require_rungs, unbiased_renderer
from vlnhijack.frames import Camera
from vlnhijack.rendering.fixed_illumination import FixedIlluminationRenderer
from vlnhijack.rendering.frozen_renderer import FrozenRenderer
from vlnhijack.rendering.mitsuba_renderer import MitsubaRenderer

CAMERAS = [Camera((-1.2, -1.2, 1.5), 0.8, -0.4, 8, 6)]
RUNGS = {
    ("frozen", "baked"): FrozenRenderer,
    ("prb", "baked"): MitsubaRenderer,
    ("fixed-illumination", "lit"): FixedIlluminationRenderer,
    ("prb", "lit"): MitsubaRenderer,
}


def _settings(rung: str) -> RenderSettings:
    return RenderSettings.model_validate({"rung": rung, "attack_spp": 4})


@pytest.mark.parametrize(("rung", "kind"), RUNGS)
def test_the_rung_is_the_renderer_of_the_attack(rung: str, kind: str) -> None:
    house = tiny_house("lit" if kind == "lit" else "baked")
    chosen = attack_renderer(_settings(rung), house, "cabinet_0", CAMERAS, 1)
    assert type(chosen) is RUNGS[rung, kind]
    checks = unbiased_renderer(_settings(rung), house, "cabinet_0", CAMERAS, 1)
    assert type(checks) is (FrozenRenderer if kind == "baked" else MitsubaRenderer)


@pytest.mark.parametrize(("rung", "kind"), [("frozen", "lit"), ("fixed-illumination", "baked")])
def test_a_rung_refuses_houses_of_the_other_kind(rung: str, kind: str) -> None:
    house = tiny_house("lit" if kind == "lit" else "baked")
    with pytest.raises(InputError, match=f"kind: expected .* received {kind}|'{kind}'"):
        attack_renderer(_settings(rung), house, "cabinet_0", CAMERAS, 1)


@pytest.mark.parametrize(("rung", "kind"), [("frozen", "lit"), ("fixed-illumination", "baked")])
def test_an_experiment_with_the_wrong_rung_is_refused(rung: str, kind: str) -> None:
    house = tiny_house("lit" if kind == "lit" else "baked")
    require_rungs([_settings("prb")], [house])
    with pytest.raises(InputError, match=f"rendering.rung: expected a rung for the {kind} house"):
        require_rungs([_settings("prb"), _settings(rung)], [house])


def test_light_is_renewed_after_every_so_many_iterations(monkeypatch: pytest.MonkeyPatch) -> None:
    renewed: list[torch.Tensor] = []
    monkeypatch.setattr(FixedIlluminationRenderer, "refresh", lambda _, t: renewed.append(t))
    renderer = FixedIlluminationRenderer.__new__(FixedIlluminationRenderer)
    texture = ProjectedAdam(
        torch.rand(4, 4, 3), torch.ones(4, 4, dtype=torch.bool), epsilon=0.1, lr=0.01
    )
    for iteration in range(8):
        _renew(renderer, texture, 3, iteration, 0)
    assert len(renewed) == 2
    _renew(renderer, texture, 0, 3, 0)
    assert len(renewed) == 2


def test_prb_draws_other_rays_in_every_iteration_and_the_same_after_a_resume() -> None:
    renderer = MitsubaRenderer(tiny_house(), "cabinet_0", CAMERAS, 4, 1)
    texture = ProjectedAdam(
        torch.rand(64, 64, 3), torch.ones(64, 64, dtype=torch.bool), epsilon=0.1, lr=0.01
    )
    seeds, images = [], []
    for iteration in (0, 1, 2, 1):
        _renew(renderer, texture, 0, iteration, 5)
        seeds.append(renderer.seed)
        images.append(renderer(texture.value).detach())
    assert len(set(seeds)) == 3 and seeds[3] == seeds[1]
    assert torch.equal(images[3], images[1]) and not torch.equal(images[2], images[1])
