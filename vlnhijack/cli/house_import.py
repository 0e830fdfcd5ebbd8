"""`vlnhijack house import`: houses from scans and meshes."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from vlnhijack.cli import house_scan
from vlnhijack.cli.console import console, progress_bars

app = typer.Typer(no_args_is_help=True, help="Make a house of a scan or a mesh.")
app.command()(house_scan.mp3d)


@app.command()
def mesh(
    file: Annotated[Path, typer.Argument(help="A .glb, .gltf, .obj or .ply file.")],
    name: Annotated[str, typer.Option(help="Name of the house, also its scan id.")],
    out: Annotated[Path | None, typer.Option(help="Folder; scenes/<name> by default.")] = None,
    up: Annotated[Literal["y", "z"] | None, typer.Option(help="y by default, z for PLY.")] = None,
    scale: Annotated[float, typer.Option(help="Metres of one unit of the file.")] = 1.0,
    objects: Annotated[
        Path | None, typer.Option(help="JSON that names objects and rooms (docs/import.md).")
    ] = None,
    connectivity: Annotated[
        Path | None, typer.Option(help="Folder of <name>_connectivity.json; else one is made.")
    ] = None,
    unwrap: house_scan.Unwrap = "attacked",
    allow_missing: house_scan.AllowMissing = False,
    seed: Annotated[int, typer.Option(help="Of the graph and the episodes.")] = 0,
) -> None:
    """Make a house of a glTF, OBJ or PLY file."""
    from vlnhijack.experiments.import_house import ImportOptions, import_mesh
    from vlnhijack.scenes.importing.mesh_file import ReadOptions
    from vlnhijack.settings import scenes_folder

    options = ImportOptions(
        read=ReadOptions(up, scale, allow_missing),
        labels=objects,
        connectivity=connectivity,
        unwrap_all=unwrap == "all",
        seed=seed,
    )
    with progress_bars() as progress:
        lines = import_mesh(file, name, out or scenes_folder() / name, options, progress)
    for line in lines:
        console.print(line)
