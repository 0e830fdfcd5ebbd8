"""HAMT's agent loop, one episode and one step at a time: the slow twin of the batched code.

Follows VLN-HAMT's `r2r/agent_cmt.py` (`_cand_pano_feature_variable`, `_history_variable`,
`rollout`) with angles taken from the viewpoints' positions.
"""

from functools import cache

import numpy as np
import torch
from torch import Tensor

from tests.worlds import World
from vlnhijack.frames import elevation_of, heading_of
from vlnhijack.navigation.candidates import candidates
from vlnhijack.navigation.episode import Episode
from vlnhijack.navigation.views import angle_feature, angle_features, nearest_view

candidates_of = cache(candidates)


class Step:
    """What the agent is given at one viewpoint, looking along view `base`."""

    def __init__(self, world: World, scan: str, viewpoint: str, base: int) -> None:
        graph = world.table.graphs[scan]
        views = world.features[world.table.index[scan, viewpoint]]
        found = candidates_of(graph)[viewpoint]
        around = angle_features(base)
        here = graph.positions[graph.row(viewpoint)]
        images, angles = [], []
        for candidate in found:
            offset = graph.positions[graph.row(candidate.viewpoint)] - here
            heading = heading_of(offset) - np.radians(30) * (base % 12)
            images.append(views[candidate.point_id])
            angles.append(angle_feature(heading, elevation_of(offset)))
        images.append(torch.zeros_like(views[0]))
        angles.append(np.zeros(4, np.float32))
        taken = [candidate.point_id for candidate in found]
        for view in set(range(36)) - set(taken):
            images.append(views[view])
            angles.append(around[view])
        self.views, self.base, self.around = views, base, torch.from_numpy(around)
        self.images, self.angles = torch.stack(images), torch.from_numpy(np.stack(angles))
        self.types = torch.tensor([1] * len(found) + [2] + [0] * (len(images) - len(found) - 1))
        self.exits = [candidate.viewpoint for candidate in found]
        self.exit_views = taken

    def action(self, target: str | None) -> int:
        """The token of a neighbour, or of STOP."""
        return len(self.exits) if target is None else self.exits.index(target)


def logits_along(world: World, episode: Episode, path: list[str]) -> list[tuple[Step, Tensor]]:
    """The steps of a walk along `path` and the logits (N,) that the policy gives at each."""
    policy, vocabulary = world.agent.policy, world.agent.vocabulary
    ids = torch.tensor([vocabulary.encode(episode.instruction, 60)])
    text_mask = torch.ones_like(ids, dtype=torch.bool)
    text = policy.encode_text(ids, text_mask)
    history = [policy.history_cls(1)]
    base, result = nearest_view(episode.heading), []
    for number, viewpoint in enumerate(path):
        step = Step(world, episode.scan, viewpoint, base)
        past = torch.stack(history, 1)
        logits = policy.outputs(
            text,
            text_mask,
            past,
            torch.ones(past.shape[:2], dtype=torch.bool),
            step.images[None],
            step.angles[None],
            step.types[None],
            torch.ones(1, len(step.types), dtype=torch.bool),
        ).logits[0]
        result.append((step, logits))
        if number + 1 < len(path):
            action = step.action(path[number + 1])
            history.append(
                policy.encode_history(
                    step.views[None, base],
                    step.angles[None, action],
                    step.views[None],
                    step.around[None],
                    torch.tensor([number]),
                )
            )
            base = step.exit_views[action]
    return result


def act(world: World, episode: Episode, guide: list[str], max_steps: int = 15) -> list[str]:
    """The path of the argmax agent after the guide, guide included."""
    path = list(guide)
    for _ in range(max_steps):
        step, logits = logits_along(world, episode, path)[-1]
        action = int(logits.argmax())
        if action == len(step.exits):
            break
        path.append(step.exits[action])
    return path
