"""The renderers of an experiment: the rung of the ladder that it names, and the unbiased one."""

from collections.abc import Iterable, Sequence
from itertools import product

from vlnhijack.errors import InputError
from vlnhijack.experiments.config import RenderSettings
from vlnhijack.frames import Camera
from vlnhijack.rendering.fixed_illumination import FixedIlluminationRenderer
from vlnhijack.rendering.frozen_renderer import FrozenRenderer
from vlnhijack.rendering.mitsuba_renderer import MitsubaRenderer
from vlnhijack.rendering.renderer import Renderer
from vlnhijack.scenes.house import House


def require_rungs(renderings: Sequence[RenderSettings], houses: Iterable[House]) -> None:
    """InputError where a rung is not for the kind of a house."""
    suits = {"frozen": "baked", "fixed-illumination": "lit"}
    for house, settings in product(houses, renderings):
        if suits.get(settings.rung, house.kind) != house.kind:
            raise InputError(
                field="rendering.rung",
                expected=f"a rung for the {house.kind} house {house.name}",
                received=settings.rung,
            )


def attack_renderer(
    settings: RenderSettings, house: House, object_id: str, cameras: Sequence[Camera], seed: int
) -> Renderer:
    """The renderer of `settings.rung`; InputError where the house is not of its kind."""
    spp, max_memory = settings.attack_spp, settings.max_memory
    if settings.rung == "prb":
        return MitsubaRenderer(house, object_id, cameras, spp, seed)
    make = FrozenRenderer if settings.rung == "frozen" else FixedIlluminationRenderer
    return make(house, object_id, cameras, spp, seed, max_memory=max_memory)


def unbiased_renderer(
    settings: RenderSettings, house: House, object_id: str, cameras: Sequence[Camera], seed: int
) -> Renderer:
    """The cheapest renderer without bias: frozen on baked houses, `prb` on lit ones."""
    rung = "frozen" if house.kind == "baked" else "prb"
    return attack_renderer(
        settings.model_copy(update={"rung": rung}), house, object_id, cameras, seed
    )
