"""Make a house folder of a mesh that others made."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.progress import Progress

from vlnhijack.artifacts import require_replaceable
from vlnhijack.navigation.episode import episode_records
from vlnhijack.navigation.graph import NavigationGraph, load_graph
from vlnhijack.scenes.house import House, Room
from vlnhijack.scenes.house_files import HOUSE_FILE, check_name, load_house, save_house
from vlnhijack.scenes.importing.assemble import assemble
from vlnhijack.scenes.importing.free_space import make_walking_graph
from vlnhijack.scenes.importing.labels import label_by_file, label_by_name
from vlnhijack.scenes.importing.mesh_file import ReadOptions, read_mesh
from vlnhijack.scenes.importing.sides import show_sides
from vlnhijack.scenes.importing.source_mesh import SourceMesh
from vlnhijack.scenes.importing.unwrapping import unwrapped
from vlnhijack.scenes.procedural.episodes import make_episodes


@dataclass(frozen=True)
class ImportOptions:
    """What a user may say about a mesh.

    labels: JSON file of objects and rooms; connectivity: folder with <name>_connectivity.json
    instead of a generated graph; unwrap_all: make all objects attackable now rather than when an
    attack needs them; seed: of graph, episodes and instructions.
    """

    read: ReadOptions = ReadOptions()
    labels: Path | None = None
    connectivity: Path | None = None
    unwrap_all: bool = False
    seed: int = 0


def import_mesh(
    file: Path, name: str, folder: Path, options: ImportOptions, progress: Progress
) -> list[str]:
    """Write the house of a mesh file to `folder`, as a whole or not at all; lines about it."""
    check_name(name, folder)
    require_replaceable(folder, HOUSE_FILE)
    started = time.perf_counter()
    stages = Stages(progress, name, total=7 if options.unwrap_all else 6)
    stages.next("read")
    read = read_mesh(file, options.read)
    if options.labels is None:
        source, rooms = label_by_name(read)
    else:
        source, rooms = label_by_file(read, options.labels)
    stages.next("navigation graph")
    if options.connectivity is None:
        graph = make_walking_graph(source, name, options.seed)
    else:
        graph = load_graph(options.connectivity, name)
    lines = write_house(source, rooms, graph, folder, options, stages)
    seconds = time.perf_counter() - started
    return [*read.notes, *lines, f"{folder}: {seconds:.0f} s"]


class Stages:
    """One progress bar for the stages of an import."""

    def __init__(self, progress: Progress, name: str, total: int) -> None:
        self._progress, self._name = progress, name
        self._task = progress.add_task(name, total=total)
        self._done = 0

    def next(self, stage: str) -> None:
        """The stage before is done, this one begins."""
        description = f"{self._name}: {stage}"
        self._progress.update(self._task, completed=self._done, description=description)
        self._done += 1

    def finish(self) -> None:
        self._progress.update(self._task, completed=self._done)


def write_house(
    source: SourceMesh,
    rooms: Sequence[Room],
    graph: NavigationGraph,
    folder: Path,
    options: ImportOptions,
    stages: Stages,
) -> list[str]:
    """Assemble a house from a labelled mesh and write it with episodes; lines about it."""
    stages.next("sides of faces")
    source, sides = show_sides(source, graph.positions)
    stages.next("surfaces")
    house = assemble(source, graph.scan, graph, rooms)
    if options.unwrap_all:
        stages.next("unwrapping")
        house = unwrapped(house, [thing.id for thing in house.objects])
    stages.next("episodes")
    train, val_seen = make_episodes(house, options.seed)
    stages.next("writing")
    records = {"train": episode_records(train), "val_seen": episode_records(val_seen)}
    save_house(house, folder, records)
    stages.finish()
    return [
        f"faces: {len(source.faces)}; seen from the back {sides.seen_from_back}, "
        f"turned round {sides.turned}, made two-sided {sides.doubled}",
        f"objects: {_counts(house)}",
        f"{len(house.rooms)} rooms, {len(graph.viewpoints)} viewpoints, "
        f"{len(train)} train and {len(val_seen)} val_seen episodes",
    ]


def unwrap_folder(folder: Path, object_ids: Sequence[str]) -> None:
    """Rewrite a house so that these objects, or all if none is named, can be attacked."""
    house = load_house(folder)
    names = object_ids or [thing.id for thing in house.objects]
    save_house(unwrapped(house, names), folder)


def _counts(house: House) -> str:
    categories = [thing.category for thing in house.objects]
    counts = (f"{categories.count(name)} {name}" for name in sorted(set(categories)))
    return ", ".join(counts) or "none"
