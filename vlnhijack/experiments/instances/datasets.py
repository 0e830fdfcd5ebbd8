"""The scans of a data set on disk: graphs, episodes, and which objects are seen where."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from vlnhijack.errors import InputError
from vlnhijack.experiments.config import DatasetInstances
from vlnhijack.experiments.instances.houses import rendered_places
from vlnhijack.experiments.instances.rules import Place, Scan
from vlnhijack.navigation.episode import Episode, by_scan, stream_episodes
from vlnhijack.navigation.graph import GraphFolder, NavigationGraph, load_graph
from vlnhijack.scenes.categories import read_categories
from vlnhijack.scenes.house_files import load_house
from vlnhijack.scenes.reverie import stream_sightings
from vlnhijack.settings import SCENE_FILE, house_folder, house_names

_EPISODES = {
    "r2r": ("R2R_{}_enc.json", "R2R_{}.json"),
    "r4r": ("R4R_{}_enc.json", "R4R_{}.json"),
    "rxr": ("rxr_{}_guide_enc_xlmr.jsonl", "rxr_{}_guide.jsonl"),
}
_GRAPHS = ("connectivity", "connectivity.tar.gz", "../R2R/connectivity")
_BOXES = ("BBox", "reverie_boxes_v1.json")
_MASK_SIZE = (160, 120)  # pixels, of 4 rays each, where no coverage is kept with the house
_CATEGORIES = ("category_mapping.tsv", "matterport_category_mappings.tsv")


def load_scans(folder: Path, settings: DatasetInstances) -> list[Scan]:
    """The scans of the data set in `folder` that have val_seen episodes, in alphabetical order.

    With masks, only those with a house. Raises InputError where a file is missing or bad.
    """
    graphs = _graphs(folder, settings)
    episodes = {
        split: by_scan(_episodes(folder, split, graphs, settings))
        for split in ("train", "val_seen")
    }
    scans = sorted(episodes["val_seen"])
    if settings.visibility == "masks":
        houses = {path.name: path for path in folder.glob("*") if settings.dataset == "houses"}
        houses = houses or {name: house_folder(name) for name in house_names()}
        places = _mask_places({scan: houses[scan] for scan in scans if scan in houses})
    else:
        places = _box_places(folder, graphs, settings)
    return [
        Scan(
            graphs[scan], places[scan], episodes["train"].get(scan, []), episodes["val_seen"][scan]
        )
        for scan in scans
        if scan in places
    ]


def _graphs(folder: Path, settings: DatasetInstances) -> Mapping[str, NavigationGraph]:
    if settings.dataset != "houses":
        return GraphFolder(_find(folder, _GRAPHS, settings.files.connectivity, "connectivity"))
    names = sorted(path.parent.name for path in folder.glob(f"*/{SCENE_FILE}"))
    if not names:
        raise InputError(file=folder, expected="a folder of houses", received="none")
    return {name: load_graph(folder / name, name) for name in names}


def _episodes(
    folder: Path,
    split: str,
    graphs: Mapping[str, NavigationGraph],
    settings: DatasetInstances,
) -> Iterable[Episode]:
    if settings.dataset == "houses":
        for name in graphs:
            file = folder / name / "episodes" / f"{split}.json"
            if file.exists():
                yield from stream_episodes(file, graphs)
        return
    names = [form.format(split) for form in _EPISODES[settings.dataset]]
    yield from stream_episodes(_find(folder, names, None, split), graphs, settings.languages)


def _box_places(
    folder: Path, graphs: Mapping[str, NavigationGraph], settings: DatasetInstances
) -> dict[str, list[Place]]:
    files = settings.files
    boxes = _find(folder, _BOXES, files.boxes, "REVERIE's boxes")
    table: Mapping[str, str] | None = None
    if settings.category_map == "mpcat40":
        table = read_categories(_find(folder, _CATEGORIES, files.categories, "categories"))
    places: dict[str, list[Place]] = {scan: [] for scan in graphs}
    for seen in stream_sightings(boxes, graphs):
        if table is not None and seen.name not in table:
            raise InputError(
                file=boxes,
                field=f"{seen.scan}_{seen.viewpoint}: {seen.object_id}: name",
                expected="a raw category of the category table",
                received=seen.name,
            )
        category = seen.name.replace(" ", "_") if table is None else table[seen.name]
        places[seen.scan].append(Place(seen.object_id, category, seen.viewpoint, seen.largest))
    return places


def _mask_places(houses: Mapping[str, Path]) -> dict[str, list[Place]]:
    """What is seen in the houses of these folders."""
    from vlnhijack.experiments.house_coverage import load_coverage
    from vlnhijack.experiments.views import coverage_table

    if not houses:
        raise InputError(field="masks", expected="houses of the data set's scans", received="none")
    places = {}
    for scan, folder in houses.items():
        house = load_house(folder)
        kept = load_coverage(folder, house)
        shares = kept.shares if kept else coverage_table(house, *_MASK_SIZE)
        places[scan] = rendered_places(house, shares)
    return places


def _find(folder: Path, names: Sequence[str], given: str | None, what: str) -> Path:
    if given is not None:
        return Path(given)
    for name in names:
        for place in (folder, folder / "annotations"):
            for path in (place / name, place / f"{name}.gz"):
                if path.exists():
                    return path
    raise InputError(file=folder, field=what, expected=" or ".join(names), received="none of them")
