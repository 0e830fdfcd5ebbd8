"""Measure a clean agent: on freshly rendered views, or on stored features without any house."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import torch
from rich.progress import Progress
from torch import Tensor

from vlnhijack import seeds
from vlnhijack.agents.checkpoints import Agent, load_agent, read_description, record_metadata
from vlnhijack.agents.features import read_features
from vlnhijack.agents.observation import observation_table
from vlnhijack.errors import InputError
from vlnhijack.evaluation.ablations import rates
from vlnhijack.evaluation.evaluate import Rates, mean_scores, navigate
from vlnhijack.experiments.context import agent_file, episodes_of, load_houses
from vlnhijack.experiments.train_agent import AgentConfig, measure, what_it_sees
from vlnhijack.experiments.views import encode_house
from vlnhijack.navigation.episode import by_scan, stream_episodes
from vlnhijack.navigation.graph import GraphFolder
from vlnhijack.scenes.house import House
from vlnhijack.scenes.house_files import load_house
from vlnhijack.settings import house_folder

_BATCH = 64


class Rendering(NamedTuple):
    """Samples per pixel and seed of the views."""

    spp: int
    seed: int


class StoredViews(NamedTuple):
    """HAMT's HDF5 features, an annotation file, and a connectivity folder or archive.

    languages of Room-across-Room, all of them where none is given.
    """

    features: Path
    annotations: Path
    connectivity: Path
    languages: Sequence[str] = ()


def evaluate_agent(name: str, rendering: Rendering, progress: Progress) -> dict[str, Any]:
    """Clean rates on val_seen and val_unseen of the houses the agent was trained with.

    The same form as the metadata of the agent: see `measure`. Raises InputError for an agent that
    was not trained here.
    """
    agent = load_agent(agent_file(name))
    if "config" not in agent.metadata:
        raise InputError(
            file=agent.path,
            expected="an agent trained by vlnhijack, or --house",
            received="a converted one",
        )
    config = AgentConfig.model_validate(agent.metadata["config"])
    houses = {
        house: load_house(house_folder(house))
        for house in [*config.train_houses, *config.unseen_houses]
    }
    parts = [_encode(agent, house, rendering, progress) for house in houses.values()]
    table = observation_table([house.graph for house in houses.values()])
    features = what_it_sees(config, agent, torch.cat(parts))
    return measure(config, agent, table, features, houses)


def evaluate_in_houses(
    name: str, houses: Sequence[str], rendering: Rendering, record: bool, progress: Progress
) -> dict[str, Rates]:
    """Clean rates on the val_seen episodes of each house, by its name.

    record: write them beside the weights, where the baseline gate of experiments looks for them.
    """
    agent = load_agent(agent_file(name))
    found: dict[str, Rates] = {}
    for folder, house in load_houses(houses).items():
        episodes = episodes_of(house, folder, "val_seen")
        agent.reader(episodes)
        features = _encode(agent, house, rendering, progress)
        found[house.name] = rates(agent, observation_table([house.graph]), features, episodes)
    if record:
        known = read_description(agent.path).metadata.get("val_seen_by_house", {})
        record_metadata(agent.path, {"val_seen_by_house": known | found})
    return found


def evaluate_stored(name: str, stored: StoredViews, progress: Progress) -> Rates:
    """Clean rates on the episodes of a data set, from features alone: no scan is needed.

    Features are read scan by scan. Raises InputError where files do not fit the agent.
    """
    agent = load_agent(agent_file(name))
    graphs = GraphFolder(stored.connectivity)
    scans = by_scan(stream_episodes(stored.annotations, graphs, stored.languages))
    task = progress.add_task("episodes", total=sum(map(len, scans.values())))
    scores = []
    for scan, episodes in scans.items():
        table, size = observation_table([graphs[scan]]), agent.policy.config.image_feat_size
        features = torch.from_numpy(read_features(stored.features, graphs[scan], size))
        for start in range(0, len(episodes), _BATCH):
            batch = episodes[start : start + _BATCH]
            scores += navigate(agent, table, features, batch)
            progress.advance(task, len(batch))
    if not scores:
        raise InputError(file=stored.annotations, expected="≥ 1 episode", received="none")
    return mean_scores(scores)


def _encode(agent: Agent, house: House, rendering: Rendering, progress: Progress) -> Tensor:
    task = progress.add_task(f"views of {house.name}", total=36 * len(house.graph.viewpoints))
    seed = seeds.integer(rendering.seed, "views", house.name)
    return encode_house(house, agent.encoder, rendering.spp, seed, partial(progress.advance, task))
