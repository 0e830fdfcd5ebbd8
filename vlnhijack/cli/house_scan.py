"""`vlnhijack house import mp3d`, `export`, `panoramas`, `coverage`: houses and Matterport3D."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from vlnhijack.cli.console import console, progress_bars

Connectivity = Annotated[
    Path, typer.Option(help="Folder or archive (.tar.gz) of <scan>_connectivity.json.")
]
Unwrap = Annotated[
    Literal["attacked", "all"],
    typer.Option(help="When objects get textures of their own: when attacked, or all now."),
]
AllowMissing = Annotated[
    bool, typer.Option("--allow-missing", help="Flat colours for missing or broken images.")
]


def mp3d(
    scan: Annotated[Path, typer.Argument(help="Folder of a scan, its parts plain or zipped.")],
    connectivity: Connectivity,
    out: Annotated[Path | None, typer.Option(help="Folder; scenes/<scan> by default.")] = None,
    unwrap: Unwrap = "attacked",
    allow_missing: AllowMissing = False,
    seed: Annotated[int, typer.Option(help="Of the episodes.")] = 0,
) -> None:
    """Make a house of a Matterport3D scan."""
    from vlnhijack.experiments.import_house import ImportOptions
    from vlnhijack.experiments.import_scan import import_scan
    from vlnhijack.scenes.importing.mesh_file import ReadOptions
    from vlnhijack.settings import scenes_folder

    options = ImportOptions(
        read=ReadOptions(up="z", allow_missing=allow_missing),
        unwrap_all=unwrap == "all",
        seed=seed,
    )
    folder = out or scenes_folder() / scan.resolve().name
    with progress_bars() as progress:
        lines = import_scan(scan, connectivity, folder, options, progress)
    for line in lines:
        console.print(line)


def export(
    house: Annotated[str, typer.Argument(help="A house of scenes/, or a folder.")],
    out: Annotated[Path, typer.Option(help="Folder for <name>/ and connectivity/.")],
    edge: Annotated[int, typer.Option(min=2, help="Pixels along a skybox image.")] = 512,
) -> None:
    """Write a baked house in Matterport3D's layout."""
    from vlnhijack.experiments.export_house import export_house
    from vlnhijack.settings import house_folder

    with progress_bars() as progress:
        scan = export_house(house_folder(house), out, edge, progress)
    console.print(f"{scan}, {out / 'connectivity'}")


def panoramas(
    scan: Annotated[Path, typer.Argument(help="Folder of a scan with matterport_skybox_images.")],
    connectivity: Connectivity,
    out: Annotated[Path, typer.Option(help="Folder for <viewpoint>_<view>.png.")],
    viewpoint: Annotated[
        list[str] | None, typer.Option(help="May be repeated; all by default.")
    ] = None,
) -> None:
    """Write the 36 real views of viewpoints as MatterSim shows them."""
    from vlnhijack.experiments.export_house import save_panoramas
    from vlnhijack.navigation.graph import scan_graph

    graph = scan_graph(connectivity, scan.resolve().name)
    with progress_bars() as progress:
        save_panoramas(scan, graph, viewpoint or graph.viewpoints, out, progress)


def coverage(
    house: Annotated[str, typer.Argument(help="A house of scenes/, or a folder.")],
) -> None:
    """Count the pixels of each view that objects fill; kept with the house as coverage.json."""
    from vlnhijack.experiments.house_coverage import FILE, measure_coverage
    from vlnhijack.navigation.views import VIEWS
    from vlnhijack.scenes.house_files import load_house
    from vlnhijack.settings import house_folder

    folder = house_folder(house)
    loaded = load_house(folder)
    with progress_bars() as progress:
        total = VIEWS * len(loaded.graph.viewpoints)
        task = progress.add_task(f"{loaded.name}: views", total=total)
        found = measure_coverage(folder, loaded, lambda views: progress.advance(task, views))
    seen = found.pixels.any((0, 1)).sum()
    console.print(f"{folder / FILE}: {seen} of {found.pixels.shape[2]} objects are seen")
