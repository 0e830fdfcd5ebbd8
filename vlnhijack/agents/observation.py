"""Observations without their pixels: tokens, angles and actions of every viewpoint.

An observation is a list of tokens as HAMT builds it: the candidates, STOP, then the views that are
no candidate's (`make_candidate` and `_cand_pano_feature_variable` of VLN-HAMT). It depends on the
viewpoint and on the agent's current view only, so it is tabulated once for all scans.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from vlnhijack.errors import InputError
from vlnhijack.navigation.candidates import candidates
from vlnhijack.navigation.graph import NavigationGraph
from vlnhijack.navigation.views import angle_features, view_angles

VIEWS = 36
NAVIGABLE, STOP_TYPE = 1, 2


class Observation(NamedTuple):
    """K observations of N tokens; see `Hamt.forward` for the last four."""

    rows: Tensor
    angles: Tensor
    nav_types: Tensor
    mask: Tensor


@dataclass(frozen=True, eq=False)
class ObservationTable:
    """Tokens of all M viewpoints of all scans, padded to N.

    rows (M,N) int64: view of each token, 36 for STOP and padding; nav_types (M,N): 1 candidate,
    2 STOP, 0 other view; targets (M,N): viewpoint that a candidate leads to, −1 elsewhere;
    headings, elevations (M,N) radians; mask (M,N) False for padding; stops (M,) token of STOP.
    """

    index: Mapping[tuple[str, str], int]
    graphs: Mapping[str, NavigationGraph]
    rows: Tensor
    nav_types: Tensor
    targets: Tensor
    headings: Tensor
    elevations: Tensor
    mask: Tensor
    stops: Tensor
    view_angle_features: Tensor

    def viewpoint(self, row: int) -> str:
        """Viewpoint id of a row."""
        return self._names[row][1]

    @property
    def _names(self) -> list[tuple[str, str]]:
        return list(self.index)

    def observe(self, viewpoints: Tensor, views: Tensor) -> Observation:
        """Observations (K,N) at viewpoints (K,) seen with the current views (K,)."""
        base = (views % 12).to(torch.float64) * (np.pi / 6)
        heading = self.headings[viewpoints] - base[:, None]
        elevation = self.elevations[viewpoints]
        angles = torch.stack([heading.sin(), heading.cos(), elevation.sin(), elevation.cos()], -1)
        rows = self.rows[viewpoints]
        angles = torch.where((rows < VIEWS)[..., None], angles, 0.0).float()
        return Observation(rows, angles, self.nav_types[viewpoints], self.mask[viewpoints])

    def actions(self, viewpoints: Tensor, targets: Tensor) -> Tensor:
        """Tokens (K,) that lead from viewpoints (K,) to targets (K,); a target −1 means STOP.

        Raises InputError where a target is no neighbour.
        """
        matches = self.targets[viewpoints] == targets[:, None]
        matches &= self.nav_types[viewpoints] == NAVIGABLE
        for row in torch.nonzero((targets >= 0) & ~matches.any(1)).flatten().tolist():
            here, there = self.viewpoint(int(viewpoints[row])), self.viewpoint(int(targets[row]))
            raise InputError(field="step", expected=f"a neighbour of {here}", received=there)
        return torch.where(targets < 0, self.stops[viewpoints], matches.long().argmax(1))


def gather_views(features: Tensor, viewpoints: Tensor, rows: Tensor) -> Tensor:
    """Image features (K,N,D) of token rows (K,N); row 36 is zero. features is (M,36,D)."""
    zero = features.new_zeros(())
    picked = features[viewpoints[:, None], rows.clamp(max=VIEWS - 1)]
    return torch.where((rows < VIEWS)[..., None], picked, zero)


def observation_table(graphs: Sequence[NavigationGraph]) -> ObservationTable:
    """Tabulate the observations of all viewpoints of the given scans."""
    index: dict[tuple[str, str], int] = {}
    for graph in graphs:
        for viewpoint in graph.viewpoints:
            index[graph.scan, viewpoint] = len(index)
    tokens = [
        _tokens(index, graph.scan, found)
        for graph in graphs
        for found in _candidates_in_order(graph)
    ]
    width = max(len(row) for row in tokens)
    blank = (VIEWS, 0, -1, 0.0, 0.0, False)
    columns = [
        [list(column) for column in zip(*(row + [blank] * (width - len(row))), strict=True)]
        for row in tokens
    ]
    rows, types, targets, headings, elevations, mask = zip(*columns, strict=True)
    nav_types = torch.tensor(types)
    return ObservationTable(
        index=index,
        graphs={graph.scan: graph for graph in graphs},
        rows=torch.tensor(rows),
        nav_types=nav_types,
        targets=torch.tensor(targets),
        headings=torch.tensor(headings, dtype=torch.float64),
        elevations=torch.tensor(elevations, dtype=torch.float64),
        mask=torch.tensor(mask),
        stops=(nav_types == STOP_TYPE).long().argmax(1),
        view_angle_features=torch.from_numpy(
            np.stack([angle_features(base) for base in range(VIEWS)])
        ),
    )


def _candidates_in_order(graph: NavigationGraph) -> list[list]:
    found = candidates(graph)
    return [found[viewpoint] for viewpoint in graph.viewpoints]


def _tokens(index: Mapping[tuple[str, str], int], scan: str, found: list) -> list[tuple]:
    used = {candidate.point_id for candidate in found}
    tokens: list[tuple] = [
        (c.point_id, NAVIGABLE, index[scan, c.viewpoint], c.heading, c.elevation, True)
        for c in found
    ]
    tokens.append((VIEWS, STOP_TYPE, -1, 0.0, 0.0, True))
    tokens += [(view, 0, -1, *view_angles(view), True) for view in range(VIEWS) if view not in used]
    return tokens
