"""Does the agent use what it sees and reads? Each ablation takes one of them away."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from vlnhijack import seeds
from vlnhijack.agents.checkpoints import Agent
from vlnhijack.agents.observation import ObservationTable
from vlnhijack.errors import InputError
from vlnhijack.evaluation.evaluate import Rates, mean_scores, navigate
from vlnhijack.navigation.episode import Episode


def rates(
    agent: Agent, table: ObservationTable, features: Tensor, episodes: Sequence[Episode]
) -> Rates:
    """The `mean_scores` of the agent on ordinary episodes."""
    return mean_scores(navigate(agent, table, features, episodes))


def ablate(
    agent: Agent,
    table: ObservationTable,
    features: Tensor,
    episodes: Sequence[Episode],
    word_groups: Sequence[Mapping[str, str]],
    seed: int,
) -> dict[str, Rates]:
    """Rates of the clean agent and of its ablations.

    "shuffled": every episode reads the instruction of another path of its scan; "blank": every view
    is mid-grey; "words": object and room words replaced by others of their group at random.
    """
    return {
        "clean": rates(agent, table, features, episodes),
        "shuffled": rates(agent, table, features, shuffle_instructions(episodes, seed)),
        "blank": rates(agent, table, blank_features(agent, features), episodes),
        "words": rates(agent, table, features, replace_words(episodes, word_groups, seed)),
    }


def shuffle_instructions(episodes: Sequence[Episode], seed: int) -> list[Episode]:
    """Every episode with the instruction of another path of the same scan.

    Raises InputError where a scan has one path only.
    """
    rng = seeds.stream(seed, "shuffled instructions")
    shuffled = []
    for episode in episodes:
        others = [
            (other.instruction, other.encoding)
            for other in episodes
            if other.scan == episode.scan and other.path_id != episode.path_id
        ]
        if not others:
            raise InputError(
                field=f"paths of {episode.scan}", expected="two or more", received="one"
            )
        text, encoding = others[rng.integers(len(others))]
        shuffled.append(replace(episode, instruction=text, encoding=encoding))
    return shuffled


@torch.no_grad()
def blank_features(agent: Agent, features: Tensor) -> Tensor:
    """Features (M,36,D) of an agent that sees a mid-grey image everywhere."""
    height, width = agent.encoder.image_size
    return agent.encoder(torch.full((1, 3, height, width), 0.5))[0].expand_as(features)


def replace_words(
    episodes: Sequence[Episode], word_groups: Sequence[Mapping[str, str]], seed: int
) -> list[Episode]:
    """Instructions whose object and room words name another category of the same group.

    word_groups maps words or phrases to their category, a mapping per group.
    """
    rng = seeds.stream(seed, "replaced words")
    swaps = [(_pattern(group), _other(group, rng)) for group in word_groups]
    replaced = []
    for episode in episodes:
        text = episode.instruction
        for pattern, other in swaps:
            text = pattern.sub(other, text)
        replaced.append(replace(episode, instruction=text, encoding=None))
    return replaced


def _pattern(group: Mapping[str, str]) -> re.Pattern[str]:
    longest_first = sorted(group, key=len, reverse=True)
    return re.compile(rf"\b({'|'.join(map(re.escape, longest_first))})\b", re.IGNORECASE)


def _other(group: Mapping[str, str], rng: np.random.Generator) -> Callable[[re.Match[str]], str]:
    words = sorted(group)

    def other(match: re.Match[str]) -> str:
        category = group[match[0].lower()]
        choices = [word for word in words if group[word] != category]
        return choices[rng.integers(len(choices))]

    return other
