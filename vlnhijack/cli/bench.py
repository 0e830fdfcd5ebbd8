"""`vlnhijack bench`: measure renderers and attacks."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from vlnhijack.cli.bench_attack import attack
from vlnhijack.cli.console import console, progress_bars

if TYPE_CHECKING:
    from rich.table import Table

    from vlnhijack.experiments.bench.subject import Subject
    from vlnhijack.scenes.house import House

app = typer.Typer(no_args_is_help=True, help="Measure renderers and attacks.")
app.command()(attack)


@app.command()
def render(
    house: Annotated[str, typer.Argument(help="A house: its folder, or a shipped name.")],
    object_id: Annotated[
        str | None, typer.Option("--object", help="By default the one that fills a view most.")
    ] = None,
    viewpoint: Annotated[
        str | None, typer.Option(help="By default where the object fills a view most.")
    ] = None,
    lit: Annotated[
        bool | None, typer.Option("--lit/--baked", help="Refuse a house of the other kind.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder of the results.")] = Path("bench"),
    size: Annotated[
        tuple[int, int] | None,
        typer.Option(min=1, help="Width and height in pixels; by default 640 480, lit 128 96."),
    ] = None,
    spp: Annotated[
        list[int] | None,
        typer.Option(
            min=1, help="Samples per pixel, a square; repeatable; by default 1 4 16 64, lit 4 16."
        ),
    ] = None,
    full: Annotated[
        bool, typer.Option("--full", help="Also growth with faces, texels, views and samples.")
    ] = False,
) -> None:
    """Time, memory and error of every renderer on one view, side by side."""
    from vlnhijack.artifacts import write_json
    from vlnhijack.experiments.bench.costs import machine
    from vlnhijack.experiments.bench.render import SIZES, SPPS, bench_render
    from vlnhijack.report.benchmarks import pareto
    from vlnhijack.scenes.house_files import load_house
    from vlnhijack.settings import house_folder

    loaded = load_house(house_folder(house))
    _require_kind(loaded, lit)
    size = size or SIZES[loaded.kind]
    subject, where = _subject(loaded, object_id, viewpoint, size)
    with progress_bars() as progress:
        rows, reference = bench_render(subject, spp or SPPS[loaded.kind], progress)
    records = [vars(row) for row in rows]
    title = f"{loaded.name} ({loaded.kind}), {size[0]} × {size[1]} pixels"
    write_json(
        out / "render.json",
        {"rows": records, "reference": reference, "settings": where, "machine": machine()},
    )
    _write_csv(out / "render.csv", records)
    pareto(out / "pareto.png", records, title)
    _print_rows(records, title)
    console.print(", ".join(f"{name} {value}" for name, value in where.items()))
    if full:
        _scaling(subject, out, where)
    console.print(f"written: {out}")


def _require_kind(house: "House", lit: bool | None) -> None:
    from vlnhijack.errors import InputError

    expected = house.kind if lit is None else ("lit" if lit else "baked")
    if house.kind != expected:
        raise InputError(file=house.name, field="kind", expected=expected, received=house.kind)


def _subject(
    house: "House", object_id: str | None, viewpoint: str | None, size: tuple[int, int]
) -> tuple["Subject", dict[str, Any]]:
    """What is rendered, and its names for the records."""
    from vlnhijack.experiments.bench.subject import Subject, fullest_view
    from vlnhijack.frames import Camera
    from vlnhijack.navigation.views import view_angles

    object_id, view = fullest_view(house, object_id, viewpoint)
    x, y, z = house.graph.positions[house.graph.row(view.viewpoint)].tolist()
    subject = Subject(house, object_id, [Camera((x, y, z), *view_angles(view.index), *size)])
    where = {"house": house.name, "kind": house.kind, "object": object_id}
    return subject, where | {"viewpoint": view.viewpoint, "view": view.index, "size": list(size)}


def _scaling(subject: "Subject", out: Path, settings: Mapping[str, Any]) -> None:
    from vlnhijack.artifacts import write_json
    from vlnhijack.experiments.bench.costs import machine
    from vlnhijack.experiments.bench.scaling import Ladders, bench_scaling, exponents
    from vlnhijack.report.benchmarks import growth

    with progress_bars() as progress:
        points = bench_scaling(subject, Ladders(), progress)
    records, fits = [vars(point) for point in points], exponents(points)
    write_json(
        out / "scaling.json",
        {"points": records, "exponents": fits, "settings": settings, "machine": machine()},
    )
    _write_csv(out / "scaling.csv", records)
    growth(out / "scaling.png", records)
    _print_exponents(fits)


def _write_csv(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    from pandas import DataFrame

    from vlnhijack.artifacts import write_text

    write_text(path, DataFrame(rows).to_csv(index=False))


def _print_rows(rows: Sequence[Mapping[str, Any]], title: str) -> None:
    from rich.table import Table

    prb = {row["spp"]: row for row in rows if row["rung"] == "prb"}
    costs, errors = Table(title=f"cost, {title}"), Table(title="error against the reference")
    _columns(
        costs, "forward\nms", "forward +\nbackward ms", "× faster\nthan prb", "build\nms", "MB"
    )
    _columns(
        errors,
        "RMSE",
        "RMSE ÷\nprb's",
        "PSNR\ndB",
        "gradient\ncosine",
        "norm\nratio",
        "bias ± s.e.",
    )
    for row in rows:
        same, name = prb[row["spp"]], (row["rung"], str(row["spp"]))
        costs.add_row(
            *name,
            f"{1000 * row['forward_s']:.1f}",
            f"{1000 * row['forward_backward_s']:.1f}",
            f"{same['forward_backward_s'] / row['forward_backward_s']:.1f}",
            f"{1000 * row['build_s']:.0f}",
            f"{row['memory_mb']:.0f}",
        )
        errors.add_row(
            *name,
            f"{row['rmse']:.5f}",
            f"{row['rmse'] / same['rmse']:.3f}",
            f"{row['psnr']:.1f}",
            f"{row['grad_cosine']:.4f}",
            f"{row['grad_norm_ratio']:.3f}",
            f"{row['grad_bias']:+.4f} ± {row['grad_bias_se']:.4f}",
        )
    console.print(costs, errors)


def _print_exponents(fits: Sequence[Mapping[str, Any]]) -> None:
    from rich.table import Table

    table = Table(title="exponents: cost ∝ value^exponent")
    for name in ("value", "rung", "forward + backward", "build", "memory"):
        table.add_column(name, justify="left" if name in ("value", "rung") else "right")
    for fit in fits:
        slopes = (fit[name] for name in ("forward_backward_s", "build_s", "memory_mb"))
        table.add_row(fit["axis"], fit["rung"], *(f"{slope:.2f}" for slope in slopes))
    console.print(table)


def _columns(table: "Table", *names: str) -> None:
    for name in ("rung", "spp", *names):
        table.add_column(
            name, justify="left" if name == "rung" else "right", no_wrap=name == "rung"
        )
