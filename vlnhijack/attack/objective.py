"""The attack's loss: −log π of the attack trajectory after the guide trajectory (paper, eq. 1)."""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from vlnhijack.agents.checkpoints import Agent
from vlnhijack.agents.observation import ObservationTable
from vlnhijack.agents.trajectory import (
    Instructions,
    Trajectories,
    history,
    read_instructions,
    renew_history,
    step_logits,
    trajectories,
)
from vlnhijack.attack.attacked_views import AttackedViews
from vlnhijack.navigation.episode import Episode
from vlnhijack.threat import AttackInstance, guide

_TOGETHER = 20


@dataclass(frozen=True, eq=False)
class Objective:
    """Teacher-forced attack trajectories of all the given episodes, tabulated once.

    walked: guide + attack trajectory of each of E episodes; first (E,) step at v_ATK;
    instructions: their encoded text; past (E,T,H): their history in the clean house. Neither is
    encoded again, but for the history of the `changing` viewpoints (M,).
    """

    agent: Agent
    table: ObservationTable
    walked: Trajectories
    first: Tensor
    instructions: Instructions
    past: Tensor
    changing: Tensor

    def __call__(self, features: Tensor, episodes: Tensor) -> Tensor:
        """Loss of each of the episodes (B,), summed over its attack steps; (B,), in nats.

        features (M,36,D) of all viewpoints, the clean ones but for those that change; gradients
        flow through observations and history.
        """
        walked = Trajectories(*(part[episodes] for part in self.walked))
        batch, steps = _attack_steps(self.first[episodes], walked.lengths)
        logits = self._logits(features, walked, episodes, batch, steps)
        actions = walked.actions(self.table)[batch, steps]
        negative = -logits.log_softmax(1).gather(1, actions[:, None])[:, 0]
        return negative.new_zeros(len(episodes)).index_add(0, batch, negative)

    def _logits(
        self, features: Tensor, walked: Trajectories, episodes: Tensor, batch: Tensor, steps: Tensor
    ) -> Tensor:
        """Logits (K,N) of step `steps[k]` of the episode in row `batch[k]` of the walked ones.

        Steps that read texts of like length go through the policy together: it computes little
        padding.
        """
        policy, table, past = self.agent.policy, self.table, self.past[episodes]
        past = renew_history(policy, table, features, walked, past, self.changing)
        read = self.instructions.rows(episodes)
        order = read.mask.sum(1)[batch].argsort(stable=True)
        logits = [
            step_logits(policy, table, features, past, read, walked, batch[part], steps[part])
            for part in order.split(_TOGETHER)
        ]
        return torch.cat(logits)[order.argsort()]


def attack_objective(
    agent: Agent,
    table: ObservationTable,
    instance: AttackInstance,
    episodes: Sequence[Episode],
    views: AttackedViews,
) -> Objective:
    """The objective of an instance over the given episodes, for textures of the given views."""
    guides = [guide(instance, episode) for episode in episodes]
    attacked = [
        [table.index[instance.scan, viewpoint] for viewpoint in (*walk, *instance.trajectory)]
        for walk in guides
    ]
    walked = trajectories(table, attacked, [episode.heading for episode in episodes])
    with torch.no_grad():
        instructions = read_instructions(agent.policy, agent.reader, episodes)
        past = history(agent.policy, table, views.clean, walked)
    return Objective(
        agent=agent,
        table=table,
        walked=walked,
        first=torch.tensor([len(walk) - 1 for walk in guides]),
        instructions=instructions,
        past=past,
        changing=views.changing(),
    )


def _attack_steps(first: Tensor, lengths: Tensor) -> tuple[Tensor, Tensor]:
    counts = lengths - first
    batch = torch.repeat_interleave(torch.arange(len(first)), counts)
    start = torch.repeat_interleave(counts.cumsum(0) - counts, counts)
    return batch, torch.arange(len(batch)) - start + first[batch]
