"""Measure a clean agent on freshly rendered views."""

from functools import partial
from typing import Any

import torch
from rich.progress import Progress

from vlnhijack import seeds
from vlnhijack.agents.checkpoints import load_agent
from vlnhijack.agents.observation import observation_table
from vlnhijack.experiments.context import agent_file
from vlnhijack.experiments.train_agent import AgentConfig, measure, what_it_sees
from vlnhijack.experiments.views import encode_house
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
    parts = []
    for house in houses.values():
        task = progress.add_task(f"views of {house.name}", total=36 * len(house.graph.viewpoints))
        advance = partial(progress.advance, task)
        view_seed = seeds.integer(seed, "views", house.name)
        parts.append(encode_house(house, agent.encoder, spp, view_seed, advance))
    table = observation_table([house.graph for house in houses.values()])
    features = what_it_sees(config, agent, torch.cat(parts))
    return measure(config, agent, table, features, houses)
