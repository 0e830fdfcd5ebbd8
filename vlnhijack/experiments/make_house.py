"""Make a procedural house with its light and its episodes."""

import time
from pathlib import Path

from rich.progress import Progress

from vlnhijack import seeds
from vlnhijack.artifacts import require_replaceable
from vlnhijack.navigation.episode import Episode, episode_records
from vlnhijack.rendering.bake import bake
from vlnhijack.scenes.house import House
from vlnhijack.scenes.house_files import HOUSE_FILE, check_name, save_house
from vlnhijack.scenes.procedural.episodes import make_episodes, viewpoint_overlap
from vlnhijack.scenes.procedural.house_maker import make_house


def make_house_folder(
    name: str,
    seed: int,
    folder: Path,
    *,
    lit: bool,
    spp: int,
    unseen: bool,
    progress: Progress,
) -> str:
    """Write the house that `seed` names to `folder`; one line about it.

    lit keeps the lights; otherwise `spp` light paths per texel are baked into the textures. unseen
    houses get all their episodes as val_unseen, others as train and val_seen.
    """
    check_name(name, folder)
    require_replaceable(folder, HOUSE_FILE)
    task = progress.add_task(f"{name}: geometry", total=3)
    started = time.perf_counter()
    house = make_house(name, seed)
    progress.update(task, completed=1, description=f"{name}: episodes")
    splits = _splits(house, seed, unseen=unseen)
    progress.update(task, completed=2, description=f"{name}: light")
    if not lit:
        house = bake(house, spp, seeds.integer(seed, "bake"))
    save_house(house, folder, {split: episode_records(found) for split, found in splits.items()})
    progress.update(task, completed=3)
    return (
        f"{folder}: {house.kind}, {len(house.rooms)} rooms, {len(house.objects)} objects, "
        f"{len(house.graph.viewpoints)} viewpoints, episodes: {_counts(splits)}; "
        f"{time.perf_counter() - started:.0f} s"
    )


def _counts(splits: dict[str, list[Episode]]) -> str:
    counts = ", ".join(f"{len(episodes)} {split}" for split, episodes in splits.items())
    if "train" not in splits:
        return counts
    overlap = viewpoint_overlap(splits["train"], splits["val_seen"])
    return f"{counts}, {overlap:.0%} of whose viewpoints are on train paths"


def _splits(house: House, seed: int, *, unseen: bool) -> dict[str, list[Episode]]:
    train, val_seen = make_episodes(house, seed)
    return {"val_unseen": val_seen} if unseen else {"train": train, "val_seen": val_seen}
