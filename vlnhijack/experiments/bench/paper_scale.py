"""An attack of the paper's size on an agent with random weights, in a shipped house."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from vlnhijack import seeds
from vlnhijack.agents.checkpoints import Agent
from vlnhijack.agents.clip import ClipConfig, ClipVisual
from vlnhijack.agents.encoder import VitEncoder
from vlnhijack.agents.hamt import Hamt
from vlnhijack.agents.hamt_config import HamtConfig
from vlnhijack.agents.observation import ObservationTable, observation_table
from vlnhijack.agents.reader import Reader
from vlnhijack.agents.vit import VisionTransformer, VitConfig
from vlnhijack.attack.attacked_views import AttackedViews
from vlnhijack.attack.objective import Objective, attack_objective
from vlnhijack.attack.projected_adam import ProjectedAdam
from vlnhijack.errors import InputError
from vlnhijack.experiments.context import episodes_of
from vlnhijack.experiments.views import coverage_table
from vlnhijack.navigation.episode import Episode
from vlnhijack.navigation.views import VIEWS, panorama_cameras
from vlnhijack.rendering.frozen_renderer import FrozenRenderer
from vlnhijack.rendering.renderer import Renderer
from vlnhijack.scenes.house import House
from vlnhijack.scenes.house_files import load_house
from vlnhijack.scenes.uv_atlas import used_texels
from vlnhijack.threat import AttackInstance

_LOOK = (64, 48)


@dataclass(frozen=True)
class Preset:
    """An agent's sizes, and its instructions: tokens ~ N(mean, deviation), `longest` at most."""

    vision: VitConfig | ClipConfig
    policy: HamtConfig
    mean: float
    deviation: float
    longest: int


PRESETS = {
    "r2r": Preset(VitConfig(), HamtConfig(), mean=33, deviation=13, longest=60),
    "rxr": Preset(
        ClipConfig(),
        HamtConfig(
            image_feat_size=512,
            no_lang_ca=True,
            vocab_size=250002,
            max_position_embeddings=514,
            type_vocab_size=2,
            layer_norm_eps=1e-5,
        ),
        mean=110,
        deviation=50,
        longest=250,
    ),
}


@dataclass(frozen=True)
class Scale:
    """How much one iteration does: the paper's batch; six views at each of three viewpoints."""

    batch: int = 16
    steps: int = 5
    viewpoints: int = 3
    views: int = 6
    width: int = 640
    height: int = 480
    spp: int = 16


@dataclass(frozen=True, eq=False)
class PaperScale:
    """All of an attack but the agent."""

    preset: Preset
    house: House
    instance: AttackInstance
    table: ObservationTable
    renderer: Renderer
    viewpoints: Tensor
    views: Tensor
    seed: int

    def agent(self) -> Agent:
        """The agent, frozen, its weights drawn by the seed."""
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seeds.integer(self.seed, "paper-scale agent"))
            encoder = VitEncoder(_vision(self.preset.vision))
            policy = Hamt(self.preset.policy)
        for model in (encoder, policy):
            model.eval().requires_grad_(False)
        return Agent(
            encoder,
            policy,
            Reader(None, self.preset.policy.vocab_size, self.preset.longest),
            {},
            Path("random"),
        )

    def problem(self, agent: Agent) -> tuple[AttackedViews, Objective]:
        """What the agent is attacked through; features of clean views are drawn by the seed."""
        generator = torch.Generator().manual_seed(seeds.integer(self.seed, "paper-scale features"))
        size = (len(self.table.index), VIEWS, agent.encoder.feature_size)
        clean = torch.randn(size, generator=generator)
        views = AttackedViews(self.renderer, agent.encoder, clean, self.viewpoints, self.views)
        return views, attack_objective(agent, self.table, self.instance, self.instance.train, views)

    def texture(self) -> ProjectedAdam:
        surface = self.house.surface(self.instance.object_id)
        used = used_texels(surface.uv, surface.faces, *surface.texture.shape[:2])
        original = torch.from_numpy(surface.texture)
        return ProjectedAdam(original, torch.from_numpy(used), epsilon=0.3)


def _vision(config: VitConfig | ClipConfig) -> VisionTransformer | ClipVisual:
    return ClipVisual(config) if isinstance(config, ClipConfig) else VisionTransformer(config)


def paper_scale(preset: Preset, folder: Path, seed: int, scale: Scale = Scale()) -> PaperScale:
    """The attack in the house of that folder whose views the object fills most.

    Raises InputError where no object is seen in so many views along a shortest path of so many
    viewpoints that starts where so many episodes pass.
    """
    house = load_house(folder)
    train = episodes_of(house, folder, "train")
    object_id, path, rows, views = _place(house, train, scale)
    passing = _through(train, path[0])
    order = seeds.stream(seed, "paper-scale episodes").permutation(len(passing))[: scale.batch]
    category = next(item.category for item in house.objects if item.id == object_id)
    episodes = _instruct([passing[index] for index in order], preset, seed)
    instance = AttackInstance(
        "bench", house.name, object_id, category, path[0], 0.0, tuple(path[1:]), episodes, (), ()
    )
    cameras = [
        panorama_cameras(tuple(house.graph.positions[row].tolist()), scale.width, scale.height)[
            view
        ]
        for row, view in zip(rows.tolist(), views.tolist(), strict=True)
    ]
    renderer = FrozenRenderer(house, object_id, cameras, scale.spp, seed)
    return PaperScale(
        preset=preset,
        house=house,
        instance=instance,
        table=observation_table([house.graph]),
        renderer=renderer,
        viewpoints=rows,
        views=views,
        seed=seed,
    )


def _through(episodes: Sequence[Episode], viewpoint: str) -> list[Episode]:
    return [episode for episode in episodes if viewpoint in episode.path]


def _place(
    house: House, train: Sequence[Episode], scale: Scale
) -> tuple[str, list[str], Tensor, Tensor]:
    """Object, path, and rows and indices of the views along its start that it fills most."""
    share = coverage_table(house, *_LOOK)
    best, found = 0.0, None
    for path in _paths(house, train, scale):
        rows = [house.graph.row(viewpoint) for viewpoint in path[: scale.viewpoints]]
        filled = np.sort(share[rows], 1)[:, -scale.views :]
        total = np.where(filled.min((0, 1)) > 0, filled.sum((0, 1)), 0)
        if total.max() > best:
            best, found = float(total.max()), (int(total.argmax()), path, rows)
    if found is None:
        expected = f"an object in {scale.views} views of each of {scale.viewpoints} viewpoints"
        raise InputError(file=house.name, field="objects", expected=expected, received="none")
    column, path, rows = found
    views = share[rows, :, column].argsort(1)[:, -scale.views :].ravel()
    places = torch.tensor(rows).repeat_interleave(scale.views), torch.from_numpy(views)
    return house.objects[column].id, path, *places


def _paths(house: House, train: Sequence[Episode], scale: Scale) -> Iterator[list[str]]:
    """Shortest paths of `steps` viewpoints from wherever enough episodes pass."""
    for start in house.graph.viewpoints:
        if len(_through(train, start)) >= scale.batch:
            paths = house.graph.shortest_paths(start).values()
            yield from (path for path in paths if len(path) == scale.steps)


def _instruct(episodes: Sequence[Episode], preset: Preset, seed: int) -> tuple[Episode, ...]:
    """The episodes with random token ids."""
    rng = seeds.stream(seed, "paper-scale instructions")
    drawn = rng.normal(preset.mean, preset.deviation, len(episodes)).round()
    lengths = drawn.astype(int).clip(3, preset.longest)
    words = (rng.integers(1, preset.policy.vocab_size, length) for length in lengths)
    return tuple(
        replace(episode, encoding=tuple(ids.tolist()))
        for episode, ids in zip(episodes, words, strict=True)
    )
