from collections.abc import Sequence

import pytest

from tests.grids import grid_graph, walks
from vlnhijack import seeds
from vlnhijack.experiments.instances.rules import Place, Scan


def everywhere(viewpoints: Sequence[str], **coverage: float) -> list[Place]:
    """Objects such as cabinet_0 that fill the same share at every viewpoint."""
    return [
        Place(name, name.split("_")[0], viewpoint, share)
        for name, share in coverage.items()
        for viewpoint in viewpoints
    ]


@pytest.fixture(scope="module")
def scan() -> Scan:
    """Every fifth path is val_seen; the table fills 30 % and the cabinet 50 % everywhere."""
    graph = grid_graph("east")
    episodes = walks(graph, shortest=3)
    held_out = set(seeds.stream(0, "split").permutation(episodes[-1].path_id + 1)[::5].tolist())
    return Scan(
        graph=graph,
        places=everywhere(graph.viewpoints, cabinet_0=0.5, table_0=0.3),
        train=[e for e in episodes if e.path_id not in held_out],
        val_seen=[e for e in episodes if e.path_id in held_out],
    )
