"""`vlnhijack bench`: measure renderers and attacks."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vlnhijack.cli.bench_attack import attack
from vlnhijack.cli.console import console, progress_bars

if TYPE_CHECKING:
    from rich.table import Table

    from vlnhijack.experiments.bench_render import Row

app = typer.Typer(no_args_is_help=True, help="Measure renderers and attacks.")
app.command()(attack)


@app.command()
def render(
    house: Annotated[str, typer.Argument(help="A baked house: its folder, or a shipped name.")],
    object_id: Annotated[
        str | None, typer.Option("--object", help="By default the one that fills a view most.")
    ] = None,
    viewpoint: Annotated[
        str | None, typer.Option(help="By default where the object fills a view most.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder of render.json.")] = Path("bench"),
    width: Annotated[int, typer.Option(min=1, help="Pixels.")] = 640,
    height: Annotated[int, typer.Option(min=1, help="Pixels.")] = 480,
    spp: Annotated[
        list[int] | None,
        typer.Option(min=1, help="Samples per pixel, a square; repeatable; 4 and 16 by default."),
    ] = None,
) -> None:
    """Time, memory and error of every renderer on one view, side by side."""
    from vlnhijack.artifacts import write_json
    from vlnhijack.experiments.bench_render import SPPS, bench_render, fullest_view
    from vlnhijack.scenes.house_files import load_house
    from vlnhijack.settings import house_folder

    loaded = load_house(house_folder(house))
    object_id, view = fullest_view(loaded, object_id, viewpoint)
    with progress_bars() as progress:
        rows = bench_render(
            loaded, object_id, view.viewpoint, view.index, (width, height), spp or SPPS, progress
        )
    write_json(out / "render.json", {"rows": [asdict(row) for row in rows]})
    console.print(f"{loaded.name}, {object_id}, view {view.index} of viewpoint {view.viewpoint}")
    _print_rows(rows, f"{width} × {height} pixels")
    console.print(f"written: {out / 'render.json'}")


def _print_rows(rows: Sequence["Row"], title: str) -> None:
    from rich.table import Table

    prb = {row.spp: row for row in rows if row.rung == "prb"}
    costs, errors = Table(title=f"cost, {title}"), Table(title="error against the reference")
    _columns(
        costs, "forward\nms", "forward +\nbackward ms", "× faster\nthan prb", "build\nms", "MB"
    )
    _columns(
        errors, "RMSE", "RMSE ÷\nprb's", "PSNR\ndB", "gradient\ncosine", "gradient\nnorm ratio"
    )
    for row in rows:
        same = prb[row.spp]
        times = (row.forward_s, row.forward_backward_s)
        costs.add_row(
            row.rung,
            str(row.spp),
            *(f"{1000 * seconds:.1f}" for seconds in times),
            f"{same.forward_backward_s / row.forward_backward_s:.1f}",
            f"{1000 * row.build_s:.0f}",
            f"{row.memory_mb:.0f}",
        )
        errors.add_row(
            row.rung,
            str(row.spp),
            f"{row.rmse:.5f}",
            f"{row.rmse / same.rmse:.3f}",
            f"{row.psnr:.1f}",
            f"{row.grad_cosine:.4f}",
            f"{row.grad_norm_ratio:.3f}",
        )
    console.print(costs, errors)


def _columns(table: "Table", *names: str) -> None:
    for name in ("rung", "spp", *names):
        table.add_column(name, justify="left" if name == "rung" else "right")
