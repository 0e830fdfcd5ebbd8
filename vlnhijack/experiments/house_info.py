"""What a house holds, what its viewpoints show, and what may be wrong with it."""

from collections.abc import Iterator
from dataclasses import dataclass

import networkx as nx
import numpy as np
from numpy.typing import NDArray

from vlnhijack.experiments.house_coverage import HouseCoverage
from vlnhijack.experiments.views import coverage_table, house_cameras
from vlnhijack.rendering.coverage import depth_map
from vlnhijack.scenes.house import House
from vlnhijack.scenes.importing.sides import seen_sides
from vlnhijack.scenes.uv_atlas import has_overlap

WIDTH, HEIGHT = 80, 60
HOLES = 1e-3  # share of camera rays that meet nothing
BACKS = 1e-3  # share of rays that meet a face from behind


@dataclass(frozen=True, eq=False)
class HouseInfo:
    """coverage (M,O): the largest share of a view at each viewpoint that each object fills."""

    house: House
    coverage: NDArray[np.float32]
    warnings: tuple[str, ...]

    @property
    def counts(self) -> dict[str, int]:
        """Rooms, objects, unwrapped objects, surfaces, faces, textures, texels, viewpoints."""
        house = self.house
        textures = {id(s.texture): s.texture.shape for s in house.surfaces}
        return {
            "rooms": len(house.rooms),
            "objects": len(house.objects),
            "objects with a texture of their own": sum(o.unwrapped for o in house.objects),
            "surfaces": len(house.surfaces),
            "faces": sum(len(s.faces) for s in house.surfaces),
            "textures": len(textures),
            "texels": sum(height * width for height, width, _ in textures.values()),
            "viewpoints": len(house.graph.viewpoints),
            "edges": int(house.graph.adjacency.sum()) // 2,
        }

    @property
    def by_category(self) -> dict[str, list[int]]:
        """Rows of the objects of each category."""
        found: dict[str, list[int]] = {}
        for row, thing in enumerate(self.house.objects):
            found.setdefault(thing.category, []).append(row)
        return dict(sorted(found.items()))


def describe(house: House, kept: HouseCoverage | None = None) -> HouseInfo:
    """Look at a house from all of its viewpoints; kept: the coverage that lies with it."""
    if kept is not None:
        coverage = kept.shares.max(axis=1)
    elif house.objects:
        coverage = coverage_table(house, WIDTH, HEIGHT).max(axis=1)
    else:
        coverage = np.zeros((len(house.graph.viewpoints), 0), np.float32)
    return HouseInfo(house, coverage, tuple(_warnings(house)))


def _warnings(house: House) -> Iterator[str]:
    vertices = np.concatenate([s.vertices for s in house.surfaces])
    starts = np.cumsum([0] + [len(s.vertices) for s in house.surfaces])
    faces = np.concatenate(
        [s.faces + start for s, start in zip(house.surfaces, starts, strict=False)]
    )
    front, back = seen_sides(vertices, faces, house.graph.positions)
    share = back.sum() / max(front.sum() + back.sum(), 1)
    if share > BACKS:
        owner = np.repeat(np.arange(len(house.surfaces)), [len(s.faces) for s in house.surfaces])
        names = [house.surfaces[row].name for row in np.unique(owner[back > 0])[:5]]
        yield (
            f"{(back > 0).sum()} faces are seen from the back, in {share:.1%} of all rays, and "
            f"look black there: {', '.join(names)}"
        )
    missed = float(np.isinf(depth_map(house, house_cameras(house.graph, WIDTH, HEIGHT))).mean())
    if missed > HOLES:
        yield f"holes: {missed:.1%} of all rays meet nothing"
    for thing in house.objects:
        if thing.unwrapped:
            surface = house.surface(thing.id)
            if has_overlap(surface.uv, surface.faces, max(surface.texture.shape[:2])):
                yield f"texture coordinates of {thing.id} overlap"
    for names in _islands(house)[1:]:
        yield f"{len(names)} viewpoints cannot be reached from the others: {', '.join(names[:3])}"


def _islands(house: House) -> list[list[str]]:
    """Viewpoints that can reach each other, the largest group first."""
    graph = nx.from_numpy_array(house.graph.adjacency)
    groups = sorted(nx.connected_components(graph), key=len, reverse=True)
    return [[house.graph.viewpoints[row] for row in sorted(group)] for group in groups]
