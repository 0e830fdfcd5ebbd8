"""Logits along given trajectories, all steps of all episodes as one batch.

HAMT's history has no recurrence: the token of a step depends on that step alone. So the history
tokens of every step are encoded at once, and every visual step sees the prefix that precedes it.
Training, the attack and rollouts all go through `step_logits`.
"""

from collections.abc import Sequence
from typing import NamedTuple

import torch
from torch import Tensor

from vlnhijack.agents.observation import ObservationTable, gather_views
from vlnhijack.agents.policy import Policy, Text, text_rows
from vlnhijack.agents.vocabulary import Vocabulary
from vlnhijack.navigation.episode import Episode
from vlnhijack.navigation.views import nearest_view

MAX_WORDS = 60


class Instructions(NamedTuple):
    """Encoded instructions of B episodes: text as the policy encodes it, mask (B,L) bool."""

    text: Text
    mask: Tensor

    def rows(self, episodes: Tensor) -> "Instructions":
        """The instructions of the given episodes (K,)."""
        return Instructions(text_rows(self.text, episodes), self.mask[episodes])


def read_instructions(
    policy: Policy, vocabulary: Vocabulary, episodes: Sequence[Episode]
) -> Instructions:
    """The episodes' instructions, encoded; at most 60 tokens each, as HAMT reads them."""
    ids, mask = vocabulary.encode_batch([episode.instruction for episode in episodes], MAX_WORDS)
    return Instructions(policy.encode_text(ids, mask), mask)


class Trajectories(NamedTuple):
    """B walked paths, padded to T steps.

    viewpoints (B,T) rows of the observation table, −1 for padding; views (B,T) the agent's current
    view at each of them; lengths (B,).
    """

    viewpoints: Tensor
    views: Tensor
    lengths: Tensor

    def actions(self, table: ObservationTable) -> Tensor:
        """Tokens (B,T) that were chosen at each step; STOP at the last, undefined in padding."""
        following = torch.cat(
            [self.viewpoints[:, 1:], torch.full_like(self.viewpoints[:, :1], -1)], dim=1
        )
        current = self.viewpoints.clamp(min=0).flatten()
        return table.actions(current, following.flatten()).view_as(self.viewpoints)


def trajectories(
    table: ObservationTable, paths: Sequence[Sequence[int]], start_headings: Sequence[float]
) -> Trajectories:
    """Trajectories of paths (rows of the table) that start with the given headings."""
    lengths = torch.tensor([len(path) for path in paths])
    viewpoints = torch.full((len(paths), int(lengths.max())), -1)
    for episode, path in enumerate(paths):
        viewpoints[episode, : len(path)] = torch.tensor(path)
    views = torch.zeros_like(viewpoints)
    views[:, 0] = torch.tensor([nearest_view(heading) for heading in start_headings])
    for step in range(viewpoints.shape[1] - 1):
        here, there = viewpoints[:, step].clamp(min=0), viewpoints[:, step + 1]
        action = table.actions(here, there)
        views[:, step + 1] = torch.where(there >= 0, table.rows[here, action], 0)
    return Trajectories(viewpoints, views, lengths)


def history(
    policy: Policy, table: ObservationTable, features: Tensor, walked: Trajectories
) -> Tensor:
    """History embeddings (B,T,H): the CLS token, then the tokens of the first T−1 steps."""
    batch, steps = walked.viewpoints.shape
    cls = policy.history_cls(batch)[:, None]
    if steps == 1:
        return cls
    viewpoints = walked.viewpoints[:, :-1].clamp(min=0).flatten()
    views = walked.views[:, :-1].flatten()
    actions = walked.actions(table)[:, :-1].flatten()
    angles = table.observe(viewpoints, views).angles[torch.arange(len(views)), actions]
    panorama = features[viewpoints]
    tokens = policy.encode_history(
        panorama[torch.arange(len(views)), views],
        angles,
        panorama,
        table.view_angle_features[views],
        torch.arange(steps - 1).repeat(batch),
    )
    return torch.cat([cls, tokens.view(batch, steps - 1, -1)], dim=1)


def step_logits(
    policy: Policy,
    table: ObservationTable,
    features: Tensor,
    instructions: Instructions,
    walked: Trajectories,
    episodes: Tensor,
    steps: Tensor,
) -> Tensor:
    """Logits (K,N) of K visual steps: step `steps[k]` of episode `episodes[k]`.

    features (M,36,D) of all viewpoints of the table. Gradients flow to features through the
    observation and through the history.
    """
    past = history(policy, table, features, walked)[episodes]
    past_mask = torch.arange(past.shape[1])[None] <= steps[:, None]
    viewpoints, views = walked.viewpoints[episodes, steps], walked.views[episodes, steps]
    seen = table.observe(viewpoints, views)
    read = instructions.rows(episodes)
    return policy(
        read.text,
        read.mask,
        past,
        past_mask,
        gather_views(features, viewpoints, seen.rows),
        seen.angles,
        seen.nav_types,
        seen.mask,
    )
