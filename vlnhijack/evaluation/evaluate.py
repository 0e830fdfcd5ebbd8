"""Force the guide trajectory, let the agent act, score what it did (paper, section 3.2)."""

from collections.abc import Mapping, Sequence

import numpy as np
import torch
from torch import Tensor

from vlnhijack.agents.checkpoints import Agent
from vlnhijack.agents.observation import ObservationTable
from vlnhijack.agents.rollout import rollout
from vlnhijack.agents.trajectory import read_instructions
from vlnhijack.evaluation.records import Record
from vlnhijack.navigation.episode import Episode
from vlnhijack.navigation.metrics import PathMetrics, path_metrics
from vlnhijack.threat import AttackInstance, guide

Rates = dict[str, float]


def act(
    agent: Agent,
    table: ObservationTable,
    features: Tensor,
    episodes: Sequence[Episode],
    guides: Sequence[Sequence[str]],
) -> list[list[str]]:
    """The viewpoints that the agent walks from the end of each guide on, that one included.

    features (M,36,D) of all viewpoints of the table.
    """
    with torch.no_grad():
        instructions = read_instructions(agent.policy, agent.reader, episodes)
    rows = [
        [table.index[episode.scan, viewpoint] for viewpoint in walk]
        for episode, walk in zip(episodes, guides, strict=True)
    ]
    headings = [episode.heading for episode in episodes]
    walked = rollout(
        agent.policy, table, features, instructions, rows, headings, max_steps=agent.max_steps
    )
    return [
        [table.viewpoint(row) for row in path[len(walk) - 1 :]]
        for path, walk in zip(walked, guides, strict=True)
    ]


def navigate(
    agent: Agent, table: ObservationTable, features: Tensor, episodes: Sequence[Episode]
) -> list[PathMetrics]:
    """Ordinary VLN evaluation: the agent acts from the start of every episode."""
    walked = act(agent, table, features, episodes, [episode.path[:1] for episode in episodes])
    return [
        path_metrics(table.graphs[episode.scan], path, episode.path)
        for episode, path in zip(episodes, walked, strict=True)
    ]


def mean_scores(scores: Sequence[PathMetrics]) -> Rates:
    """Means of SR, OSR, SPL, nDTW and SDTW (0–1), of path length and navigation error in metres,
    with the number n of episodes."""
    columns = {
        "sr": "success",
        "osr": "oracle_success",
        "spl": "spl",
        "ndtw": "ndtw",
        "sdtw": "sdtw",
        "path_length": "path_length",
        "navigation_error": "navigation_error",
    }
    means = {
        name: float(np.mean([getattr(score, column) for score in scores]))
        for name, column in columns.items()
    }
    return {"n": len(scores), **means}


def evaluate_instance(
    agent: Agent,
    table: ObservationTable,
    features: Tensor,
    instance: AttackInstance,
    arm: str,
    conditions: Mapping[str, Sequence[Episode]],
) -> list[Record]:
    """Records of an instance in one arm; `conditions` maps their names to their episodes."""
    records: list[Record] = []
    for condition, episodes in conditions.items():
        if not episodes:
            continue
        guides = [guide(instance, episode) for episode in episodes]
        walked = act(agent, table, features, episodes, guides)
        for episode, walk, path in zip(episodes, guides, walked, strict=True):
            records.append(_record(table, instance, arm, condition, episode, walk, path))
    return records


def _record(
    table: ObservationTable,
    instance: AttackInstance,
    arm: str,
    condition: str,
    episode: Episode,
    walk: Sequence[str],
    path: Sequence[str],
) -> Record:
    graph = table.graphs[instance.scan]
    attack = path_metrics(graph, path, instance.target_path)
    original = path_metrics(graph, path, episode.path[len(walk) - 1 :])
    return Record(
        instance=instance.id,
        kind=instance.kind,
        scan=instance.scan,
        object=instance.object_id,
        category=instance.category,
        viewpoint=instance.viewpoint,
        arm=arm,
        condition=condition,
        path_id=episode.path_id,
        instruction_id=episode.instruction_id,
        guide=list(walk),
        path=list(path),
        stopped=len(path) == 1,
        attack_success=attack.success,
        attack_oracle_success=attack.oracle_success,
        attack_ndtw=attack.ndtw,
        original_success=original.success,
        original_ndtw=original.ndtw,
    )
