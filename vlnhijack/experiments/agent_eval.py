"""Measure a clean agent on freshly rendered views."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import torch
from rich.progress import Progress
from torch import Tensor

from vlnhijack import seeds
from vlnhijack.agents.checkpoints import Agent, load_agent
from vlnhijack.agents.observation import observation_table
from vlnhijack.artifacts import read_json, write_json
from vlnhijack.evaluation.ablations import rates
from vlnhijack.experiments.context import agent_file, episodes_of
from vlnhijack.experiments.train_agent import AgentConfig, measure, what_it_sees
from vlnhijack.experiments.views import encode_house
from vlnhijack.scenes.house import House
from vlnhijack.scenes.house_files import load_house
from vlnhijack.settings import house_folder


def evaluate_agent(name: str, spp: int, seed: int, progress: Progress) -> dict[str, Any]:
    """Clean rates on val_seen and val_unseen of the houses the agent was trained with.

    The same form as the metadata of the agent: see `measure`.
    """
    agent = load_agent(agent_file(name))
    config = AgentConfig.model_validate(agent.metadata["config"])
    houses = {
        house: load_house(house_folder(house))
        for house in [*config.train_houses, *config.unseen_houses]
    }
    parts = [_features(agent, house, spp, seed, progress) for house in houses.values()]
    table = observation_table([house.graph for house in houses.values()])
    features = what_it_sees(config, agent, torch.cat(parts))
    return measure(config, agent, table, features, houses)


def record_rates(
    name: str, houses: Sequence[str], spp: int, seed: int, progress: Progress
) -> dict[str, dict[str, float]]:
    """Clean rates on val_seen of any houses, stored with the weights for the baseline gate."""
    agent = load_agent(agent_file(name))
    found = {}
    for house in (load_house(house_folder(house)) for house in houses):
        features = _features(agent, house, spp, seed, progress)
        table = observation_table([house.graph])
        found[house.name] = rates(agent, table, features, episodes_of(house, "val_seen"))
    file = agent.path.with_suffix(".json")
    description = read_json(file)
    description["metadata"].setdefault("val_seen_by_house", {}).update(found)
    write_json(file, description)
    return found


def _features(agent: Agent, house: House, spp: int, seed: int, progress: Progress) -> Tensor:
    """Features (M,36,D) of the views of a house."""
    task = progress.add_task(f"views of {house.name}", total=36 * len(house.graph.viewpoints))
    advance = partial(progress.advance, task)
    return encode_house(
        house, agent.encoder, spp, seeds.integer(seed, "views", house.name), advance
    )
