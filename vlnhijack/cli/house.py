"""`vlnhijack house`: make houses, render them."""

from pathlib import Path
from typing import Annotated

import typer

from vlnhijack.cli.console import console, progress_bars

app = typer.Typer(no_args_is_help=True, help="Make houses, render them.")


@app.command()
def make(
    name: Annotated[str, typer.Argument(help="Name of the house, also its scan id.")],
    seed: Annotated[int, typer.Option(help="The same seed makes the same house.")] = 0,
    out: Annotated[Path | None, typer.Option(help="Folder; scenes/<name> by default.")] = None,
    lit: Annotated[bool, typer.Option("--lit", help="Keep lights instead of baking them.")] = False,
    spp: Annotated[int, typer.Option(help="Light paths per texel of a baked house.")] = 64,
    unseen: Annotated[
        bool, typer.Option("--unseen", help="Make val_unseen episodes instead of train/val_seen.")
    ] = False,
) -> None:
    """Make a procedural house with its navigation graph and episodes."""
    from vlnhijack.experiments.make_house import make_house_folder
    from vlnhijack.settings import scenes_folder

    folder = out or scenes_folder() / name
    with progress_bars() as progress:
        made = make_house_folder(
            name, seed, folder, lit=lit, spp=spp, unseen=unseen, progress=progress
        )
    console.print(made)


@app.command()
def render(
    house: Annotated[str, typer.Argument(help="A house: its folder, or a shipped name.")],
    out: Annotated[Path, typer.Option(help="Folder of the pictures.")],
    viewpoint: Annotated[str | None, typer.Option(help="Required; without it, all are named.")] = (
        None
    ),
    views: Annotated[str, typer.Option(help="Of the 36, for example 3,5,12-14.")] = "0-35",
    object_id: Annotated[
        str | None, typer.Option("--object", help="Also write its masks, and outline it.")
    ] = None,
    rung: Annotated[
        str | None,
        typer.Option(help="frozen, fixed-illumination or prb; by default the evaluation's."),
    ] = None,
    width: Annotated[int, typer.Option(min=1, help="Pixels.")] = 640,
    height: Annotated[int, typer.Option(min=1, help="Pixels.")] = 480,
    spp: Annotated[int, typer.Option(min=1, help="Samples per pixel, a square.")] = 16,
) -> None:
    """Write views of a viewpoint as PNG files, and its panorama as a contact sheet."""
    from vlnhijack.experiments.render_house import Pictures, render_house
    from vlnhijack.navigation.views import parse_views
    from vlnhijack.scenes.house_files import load_house
    from vlnhijack.settings import house_folder

    wanted = Pictures(viewpoint, parse_views(views), width, height, spp, object_id, rung)
    with progress_bars() as progress:
        render_house(load_house(house_folder(house)), wanted, out, progress)
    console.print(f"{len(wanted.views)} views and panorama.png: {out}")
