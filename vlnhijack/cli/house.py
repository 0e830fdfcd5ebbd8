"""`vlnhijack house`: make houses, import them, look at them."""

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

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
    spp: Annotated[int, typer.Option(min=1, help="Light paths per texel, if baked.")] = 64,
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


@app.command()
def unwrap(
    house: Annotated[str, typer.Argument(help="A house of scenes/, or a folder.")],
    objects: Annotated[list[str] | None, typer.Argument(help="Ids; all by default.")] = None,
) -> None:
    """Give objects of an imported house textures of their own, so that they can be attacked."""
    from vlnhijack.experiments.import_house import unwrap_folder
    from vlnhijack.settings import house_folder

    unwrap_folder(house_folder(house), objects or [])


@app.command()
def reduce(
    house: Annotated[str, typer.Argument(help="A house of scenes/, or a folder.")],
    budget: Annotated[str, typer.Option(help="auto, FACES or FACESxTEXELS, as 50000x512.")],
    max_error: Annotated[float, typer.Option(help="RMSE that --budget auto keeps to.")] = 0.02,
    out: Annotated[Path | None, typer.Option(help="Folder; the house's own by default.")] = None,
) -> None:
    """Reduce faces and texels, and say what that costs in image error and gains."""
    from vlnhijack.experiments.reduce_house import parse_budget, reduce_folder
    from vlnhijack.settings import house_folder

    wanted, folder = parse_budget(budget), house_folder(house)
    out = out or folder
    with progress_bars() as progress:
        rows, kept = reduce_folder(folder, out, wanted, max_error, progress)
    table = Table(title=f"{house}, the original first")
    for column in ("faces", "texels", "MB", "seconds", "RMSE"):
        table.add_column(column, justify="right")
    for row in rows:
        numbers = (f"{row.megabytes:.1f}", f"{row.seconds:.2f}", f"{row.rmse:.4f}")
        table.add_row(str(row.faces), str(row.texels), *numbers)
    console.print(table)
    console.print(f"kept: {kept.faces} faces, {kept.texels} texels; written: {out}")
    if wanted is not None and wanted.faces is not None and kept.faces > wanted.faces:
        console.print(f"{wanted.faces} faces were asked for: borders and charts leave no fewer")


@app.command()
def info(
    house: Annotated[str, typer.Argument(help="A house of scenes/, or a folder.")],
) -> None:
    """What a house holds, what its viewpoints show, and warnings."""
    from vlnhijack.experiments.house_coverage import load_coverage
    from vlnhijack.experiments.house_info import describe
    from vlnhijack.scenes.house_files import load_house
    from vlnhijack.settings import house_folder

    folder = house_folder(house)
    loaded = load_house(folder)
    found = describe(loaded, load_coverage(folder, loaded))
    counts = Table("", "count")
    for name, count in found.counts.items():
        counts.add_row(name, str(count))
    console.print(counts)
    table = Table("category", "objects", "largest share of a view", "viewpoints ≥ 40 %")
    for category, rows in found.by_category.items():
        shares = found.coverage[:, rows]
        close = int((shares >= 0.4).any(axis=1).sum())
        table.add_row(category, str(len(rows)), f"{shares.max():.0%}", str(close))
    console.print(table)
    for warning in found.warnings:
        console.print(f"warning: {warning}")
