"""`vlnhijack instances`: attack instances from a data set."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from vlnhijack.cli.console import console


def instances(
    data: Annotated[Path, typer.Option(help="Folder of the data set.")],
    dataset: Annotated[
        str | None, typer.Option(help="r2r (default), r4r, rxr, or houses: a folder of ours.")
    ] = None,
    visibility: Annotated[
        str | None, typer.Option(help="reverie-boxes (default), or masks rendered from houses.")
    ] = None,
    config: Annotated[Path | None, typer.Option(help="Settings (YAML); docs/instances.md.")] = None,
    override: Annotated[
        list[str] | None, typer.Option("--set", help="key=value, as rules.min_coverage=0.5")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="A .parquet file; a .json is written beside it.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the counts as JSON.")] = False,
) -> None:
    """Construct the paper's attack instances from a data set, and count them."""
    from vlnhijack.experiments.config import DatasetInstances
    from vlnhijack.experiments.instances.datasets import load_scans
    from vlnhijack.experiments.instances.files import save_instances, summarise
    from vlnhijack.experiments.instances.paths import construct
    from vlnhijack.experiments.yaml_config import load_config

    named = {"dataset": dataset, "visibility": visibility}
    overrides = [f"{key}={value}" for key, value in named.items() if value is not None]
    settings = load_config(config, DatasetInstances, [*overrides, *(override or [])])
    attacks = construct(load_scans(data, settings), settings)
    if out is not None:
        save_instances(out, attacks, settings)
    summary = summarise(attacks)
    if as_json:
        print(json.dumps(summary))
    else:
        _print_summary(summary)


def _print_summary(summary: dict[str, Any]) -> None:
    from rich.table import Table

    table = Table("", "count")
    table.columns[1].justify = "right"
    for key, count in summary.items():
        if key != "by_category":
            table.add_row(key.replace("_", " "), str(count))
    table.add_section()
    for category, count in summary["by_category"].items():
        table.add_row(f"instances of {category}", str(count))
    console.print(table)
