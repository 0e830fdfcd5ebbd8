"""HAMT's agent loop, one episode and one step at a time: the slow twin of the batched code.

Follows VLN-HAMT's `r2r/agent_cmt.py` (`_cand_pano_feature_variable`, `_history_variable`,
`rollout`) with angles taken from the viewpoints' positions.
"""

from functools import cache
from itertools import pairwise, zip_longest

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


class Walk:
    """An agent on its way; `look` gives what it sees and its logits (N,), `move` goes on."""

    def __init__(self, world: World, episode: Episode) -> None:
        self.world, self.episode = world, episode
        self.policy = world.agent.policy
        self.ids = torch.tensor([world.agent.reader.read(episode)])
        self.read = torch.ones_like(self.ids, dtype=torch.bool)
        self.text = self.policy.encode_text(self.ids, self.read)
        self.history = [self.policy.history_cls(1)]
        self.base = nearest_view(episode.heading)

    def look(self, viewpoint: str) -> tuple[Step, Tensor]:
        step = Step(self.world, self.episode.scan, viewpoint, self.base)
        past = torch.stack(self.history, 1)
        logits = self.policy.outputs(
            self.text,
            self.read,
            past,
            torch.ones(past.shape[:2], dtype=torch.bool),
            step.images[None],
            step.angles[None],
            step.types[None],
            torch.ones(1, len(step.types), dtype=torch.bool),
        ).logits[0]
        return step, logits

    def move(self, step: Step, action: int) -> str:
        number = torch.tensor([len(self.history) - 1])
        image, angle = step.views[None, self.base], step.angles[None, action]
        token = self.policy.encode_history(
            image, angle, step.views[None], step.around[None], number
        )
        self.history.append(token)
        self.base = step.exit_views[action]
        return step.exits[action]


def logits_along(world: World, episode: Episode, path: list[str]) -> list[tuple[Step, Tensor]]:
    """The steps of a walk along `path` and the logits (N,) that the policy gives at each."""
    walk, result = Walk(world, episode), []
    for here, there in zip_longest(path, path[1:]):
        step, logits = walk.look(here)
        result.append((step, logits))
        if there is not None:
            walk.move(step, step.action(there))
    return result


def act(world: World, episode: Episode, guide: list[str], max_steps: int = 15) -> list[str]:
    """The path of the argmax agent after the guide, guide included."""
    walk, path = Walk(world, episode), list(guide)
    for here, there in pairwise(guide):
        step, _ = walk.look(here)
        walk.move(step, step.action(there))
    for _ in range(max_steps):
        step, logits = walk.look(path[-1])
        action = int(logits.argmax())
        if action == len(step.exits):
            break
        path.append(walk.move(step, action))
    return path
