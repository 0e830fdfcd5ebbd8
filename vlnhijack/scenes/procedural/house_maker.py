"""Procedural houses: plan, shell, furniture, lights and graph from one seed."""

from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np
import trimesh
from numpy.typing import NDArray

from vlnhijack.errors import CheckError
from vlnhijack.navigation.graph import NavigationGraph
from vlnhijack.scenes.house import House, HouseObject
from vlnhijack.scenes.procedural.finishes import room_finishes
from vlnhijack.scenes.procedural.floor_plan import FloorPlan, make_floor_plan
from vlnhijack.scenes.procedural.furniture import ATTACKABLE, place
from vlnhijack.scenes.procedural.layout import furnish
from vlnhijack.scenes.procedural.lighting import EXPOSURE, make_lights
from vlnhijack.scenes.procedural.painting import paint
from vlnhijack.scenes.procedural.room_layout import Placement
from vlnhijack.scenes.procedural.shapes import Mesh, join
from vlnhijack.scenes.procedural.viewpoints import make_graph
from vlnhijack.scenes.procedural.walls import Shell, room_shell
from vlnhijack.scenes.surface import Surface
from vlnhijack.seeds import stream

ATTEMPTS = 30
FEWEST_PIECES = 28
FEWEST_OF_EACH = 2

Array = NDArray[np.float64]


def make_house(name: str, seed: int) -> House:
    """The lit house that `seed` names; the same seed gives the same house.

    Plans that take too little furniture, or leave too few places to stand, are drawn again;
    CheckError after 30.
    """
    for attempt in range(ATTEMPTS):
        plan = make_floor_plan(stream(seed, "plan", attempt))
        placements = furnish(plan, stream(seed, "layout", attempt))
        if not _is_furnished(placements):
            continue
        shells = [room_shell(plan, room) for room in range(len(plan.rooms))]
        graph = _graph(name, seed, plan, placements, shells)
        if graph is not None:
            return _assemble(name, seed, plan, placements, shells, graph)
    raise CheckError(f"{name}: no walkable house in {ATTEMPTS} attempts from seed {seed}")


def _is_furnished(placements: Sequence[Placement]) -> bool:
    counts = Counter(placement.piece.category for placement in placements)
    fewest = min(counts[category] for category in ATTACKABLE)
    return counts.total() >= FEWEST_PIECES and fewest >= FEWEST_OF_EACH


def _graph(
    name: str,
    seed: int,
    plan: FloorPlan,
    placements: Sequence[Placement],
    shells: Sequence[Shell],
) -> NavigationGraph | None:
    obstacles = np.array([p.box[[0, 1, 3, 4]] for p in placements if p.blocks])
    landmarks = [
        trimesh.Trimesh(p.vertices, p.piece.mesh.faces, process=False)
        for p in placements
        if p.piece.category in ATTACKABLE
    ]
    whole = join(
        [Mesh(shell.vertices.astype(np.float64), shell.faces.astype(np.int64)) for shell in shells]
        + [Mesh(p.vertices, p.piece.mesh.faces) for p in placements]
    )
    mesh = trimesh.Trimesh(whole.vertices, whole.faces, process=False)
    return make_graph(name, seed, plan, obstacles, landmarks, mesh)


def _assemble(
    name: str,
    seed: int,
    plan: FloorPlan,
    placements: Sequence[Placement],
    shells: Sequence[Shell],
    graph: NavigationGraph,
) -> House:
    furniture = list(_furniture(placements))
    return House(
        name=name,
        kind="lit",
        surfaces=(*_background(plan, shells, seed), *furniture),
        objects=tuple(
            _describe(surface, placement, plan)
            for surface, placement in zip(furniture, placements, strict=True)
        ),
        rooms=plan.rooms,
        graph=graph,
        lights=make_lights(plan, stream(seed, "lights")),
        exposure=EXPOSURE,
    )


def _background(plan: FloorPlan, shells: Sequence[Shell], seed: int) -> Iterator[Surface]:
    """One surface a room: floor, walls, ceiling and trims."""
    finishes = room_finishes(plan, stream(seed, "finishes"))
    for room, shell, finish in zip(plan.rooms, shells, finishes, strict=True):
        texture = paint(
            shell.vertices,
            shell.faces,
            shell.uv,
            shell.face_material,
            [finish[material] for material in shell.materials],
            shell.height,
            shell.width,
        )
        yield Surface(f"shell_{room.id}", shell.vertices, shell.faces, shell.uv, texture)


def _furniture(placements: Sequence[Placement]) -> Iterator[Surface]:
    numbers: Counter[str] = Counter()
    for placement in placements:
        piece = placement.piece
        object_id = f"{piece.category}_{numbers[piece.category]:02d}"
        numbers[piece.category] += 1
        yield place(
            piece, object_id, object_id, placement.position, placement.heading, piece.texels
        )


def _describe(surface: Surface, placement: Placement, plan: FloorPlan) -> HouseObject:
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    cx, cy, cz = ((low + high) / 2).tolist()
    sx, sy, sz = (high - low).tolist()
    room = plan.rooms[placement.room].id
    category = placement.piece.category
    return HouseObject(str(surface.object_id), category, room, (cx, cy, cz), (sx, sy, sz))
