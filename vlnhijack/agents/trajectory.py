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
from vlnhijack.agents.reader import Reader
from vlnhijack.navigation.episode import Episode
from vlnhijack.navigation.views import nearest_view


class Instructions(NamedTuple):
    """Encoded instructions of B episodes: text as the policy encodes it, mask (B,L) bool."""

    text: Text
    mask: Tensor

    def rows(self, episodes: Tensor) -> "Instructions":
        """The instructions of the given episodes (K,), no longer than the longest of them."""
        mask = self.mask[episodes]
        longest = int(mask.sum(1).max())
        return Instructions(text_rows(self.text, episodes, longest), mask[:, :longest])


def read_instructions(policy: Policy, reader: Reader, episodes: Sequence[Episode]) -> Instructions:
    """The episodes' instructions, encoded."""
    ids, mask = reader(episodes)
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
    tokens = _encode(policy, table, features, _taken(table, walked).flatten(0, 1))
    return torch.cat([cls, tokens.view(batch, steps - 1, -1)], dim=1)


def renew_history(
    policy: Policy,
    table: ObservationTable,
    features: Tensor,
    walked: Trajectories,
    past: Tensor,
    changing: Tensor,
) -> Tensor:
    """`past`, the history (B,T,H) of other features, with the tokens at changing viewpoints anew.

    changing (M,) bool. Steps that several episodes take are encoded once.
    """
    renewed = changing[walked.viewpoints[:, :-1]] & (walked.viewpoints[:, 1:] >= 0)
    if not renewed.any():
        return past
    taken, places = torch.unique(_taken(table, walked)[renewed], dim=0, return_inverse=True)
    tokens = _encode(policy, table, features, taken)[places]
    episodes, steps = renewed.nonzero(as_tuple=True)
    return past.index_put((episodes, steps + 1), tokens)


def _taken(table: ObservationTable, walked: Trajectories) -> Tensor:
    """The first T−1 steps as (B,T−1,4): viewpoint, current view, action and number of the step."""
    viewpoints, views = walked.viewpoints[:, :-1].clamp(min=0), walked.views[:, :-1]
    numbers = torch.arange(views.shape[1]).expand_as(views)
    return torch.stack([viewpoints, views, walked.actions(table)[:, :-1], numbers], dim=-1)


def _encode(policy: Policy, table: ObservationTable, features: Tensor, taken: Tensor) -> Tensor:
    """History tokens (K,H) of the steps (K,4) of `_taken`."""
    viewpoints, views, actions, numbers = taken.unbind(1)
    rows = torch.arange(len(taken))
    panorama = features[viewpoints]
    return policy.encode_history(
        panorama[rows, views],
        table.observe(viewpoints, views).angles[rows, actions],
        panorama,
        table.view_angle_features[views],
        numbers,
    )


def step_logits(
    policy: Policy,
    table: ObservationTable,
    features: Tensor,
    past: Tensor,
    instructions: Instructions,
    walked: Trajectories,
    episodes: Tensor,
    steps: Tensor,
) -> Tensor:
    """Logits (K,N) of K visual steps: step `steps[k]` of episode `episodes[k]`.

    features (M,36,D) of all viewpoints of the table; past (B,T,H) as `history` gives it. Gradients
    flow to features through the observation and through the history.
    """
    past = past[episodes, : int(steps.max()) + 1]
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
