"""`vlnhijack house`: make houses, import them, look at them."""

from pathlib import Path
from typing import Annotated

import typer

from vlnhijack.cli import house_import, house_scan
from vlnhijack.cli.console import console, progress_bars

app = typer.Typer(no_args_is_help=True, help="Make houses, import them, look at them.")
app.add_typer(house_import.app, name="import")
app.command()(house_scan.export)
app.command()(house_scan.panoramas)
app.command()(house_scan.coverage)


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
def unwrap(
    house: Annotated[str, typer.Argument(help="A house of scenes/, or a folder.")],
    objects: Annotated[list[str] | None, typer.Argument(help="Ids; all by default.")] = None,
) -> None:
    """Give objects of an imported house textures of their own, so that they can be attacked."""
    from vlnhijack.experiments.import_house import unwrap_folder
    from vlnhijack.settings import house_folder

    unwrap_folder(house_folder(house), objects or [])
