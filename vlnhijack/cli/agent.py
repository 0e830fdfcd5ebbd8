"""`vlnhijack agent`: train the small agent, take over official ones, measure either."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from vlnhijack.cli.console import console, progress_bars

app = typer.Typer(no_args_is_help=True, help="Train, convert, inspect or measure an agent.")

_RATES = {"SR": "sr", "OSR": "osr", "SPL": "spl", "nDTW": "ndtw", "SDTW": "sdtw"}
_METRES = {"NE, m": "navigation_error", "TL, m": "path_length"}

Overrides = Annotated[list[str] | None, typer.Option("--set", help="key=value")]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON alone.")]


@app.command()
def train(
    config: Annotated[Path, typer.Argument(help="experiments/small_agent.yaml or your own.")],
    out: Annotated[Path | None, typer.Option(help="Run folder; runs/<name> by default.")] = None,
    override: Overrides = None,
) -> None:
    """Train an agent; an interrupted training goes on where it was."""
    from vlnhijack.experiments.train_agent import AgentConfig, train_agent
    from vlnhijack.experiments.yaml_config import load_config

    settings = load_config(config, AgentConfig, override or [])
    with progress_bars() as progress:
        agent = train_agent(settings, out or Path("runs") / settings.name, progress)
    console.print(f"weights: {agent.path}")
    _print_rates(_rows(agent.metadata))


@app.command()
def info(
    file: Annotated[Path, typer.Argument(help="An official checkpoint, or a .safetensors agent.")],
    as_json: AsJson = False,
) -> None:
    """Tell what a checkpoint is: layout, sizes, and what would be ignored."""
    from vlnhijack.experiments.convert_agent import agent_info

    found = agent_info(file)
    if as_json:
        print(json.dumps(found))
    else:
        _print_info(found)


@app.command()
def convert(
    checkpoint: Annotated[Path, typer.Argument(help="HAMT's checkpoint, of any official layout.")],
    out: Annotated[Path, typer.Argument(help="The .safetensors file to write.")],
    vision: Annotated[
        Path | None, typer.Option(help="Its ViT or CLIP, if not in the checkpoint.")
    ] = None,
    tokenizer: Annotated[
        Path | None, typer.Option(help="tokenizer.json, for instructions without token ids.")
    ] = None,
    variant: Annotated[
        str | None, typer.Option(help="r2r or rxr, if the vocabulary does not tell.")
    ] = None,
    override: Overrides = None,
) -> None:
    """Turn an official agent into one that every command takes."""
    from vlnhijack.experiments.convert_agent import ConvertSettings, convert_agent
    from vlnhijack.experiments.yaml_config import load_config

    given = [] if variant is None else [f"variant={variant}"]
    settings = load_config(None, ConvertSettings, [*given, *(override or [])])
    agent = convert_agent(checkpoint, vision, tokenizer, out, settings)
    console.print(f"agent: {agent.path}")


@app.command("eval")
def evaluate(
    agent: Annotated[
        str, typer.Argument(help="A shipped agent, or a .safetensors file.")
    ] = "small",
    house: Annotated[
        list[str] | None, typer.Option(help="val_seen of a house instead; may be repeated.")
    ] = None,
    record: Annotated[
        bool, typer.Option("--record", help="With --house: store the rates with the weights.")
    ] = False,
    spp: Annotated[int, typer.Option(min=1, help="Samples per pixel, a square.")] = 16,
    seed: Annotated[int, typer.Option()] = 1,
    as_json: AsJson = False,
) -> None:
    """Measure the clean agent on freshly rendered views: of the houses of its training, with the
    ablations, or of others."""
    from vlnhijack.errors import InputError
    from vlnhijack.experiments.agent_eval import Rendering, evaluate_agent, evaluate_in_houses

    if record and not house:
        raise InputError(field="record", expected="a --house to record", received="none")
    rendering = Rendering(spp, seed)
    with progress_bars() as progress:
        if house:
            found = evaluate_in_houses(agent, house, rendering, record, progress)
            rows = {f"val_seen, {name}": rates for name, rates in found.items()}
        else:
            rows = _rows(evaluate_agent(agent, rendering, progress))
    _show(rows, as_json)


@app.command("eval-features")
def evaluate_features(
    agent: Annotated[str, typer.Argument(help="A .safetensors file.")],
    features: Annotated[Path, typer.Option(help="HAMT's HDF5 image features.")],
    annotations: Annotated[Path, typer.Option(help=".json (R2R, R4R) or .jsonl (RxR).")],
    connectivity: Annotated[Path, typer.Option(help="Connectivity folder or archive.")],
    language: Annotated[
        list[str] | None, typer.Option(help="Of RxR, for example en; may be repeated.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Measure the clean agent on stored image features: no scan and no image is needed."""
    from vlnhijack.experiments.agent_eval import StoredViews, evaluate_stored

    stored = StoredViews(features, annotations, connectivity, language or ())
    with progress_bars() as progress:
        rates = evaluate_stored(agent, stored, progress)
    _show({annotations.name: rates}, as_json)


def _show(rows: dict[str, Any], as_json: bool) -> None:
    if as_json:
        print(json.dumps(rows))
    else:
        _print_rates(rows)


def _rows(measured: dict[str, Any]) -> dict[str, Any]:
    rows = {f"val_seen, {name}": rates for name, rates in measured["val_seen"].items()}
    rows["val_unseen"] = measured["val_unseen"]
    rows |= {f"val_seen, {name}": rates for name, rates in measured["val_seen_by_house"].items()}
    return rows


def _print_rates(rows: dict[str, Any]) -> None:
    from rich.table import Table

    table = Table("episodes", "n", *_RATES, *_METRES, title="clean agent, %")
    for column in table.columns[1:]:
        column.justify = "right"
    for name, rates in rows.items():
        shares = (f"{100 * rates[key]:.1f}" for key in _RATES.values())
        lengths = (f"{rates[key]:.2f}" for key in _METRES.values())
        table.add_row(name, str(rates["n"]), *shares, *lengths)
    console.print(table)


def _print_info(found: dict[str, Any]) -> None:
    from rich.table import Table

    table = Table(show_header=False)
    for key, value in found.items():
        if isinstance(value, dict):
            value = "\n".join(f"{name}: {part}" for name, part in value.items())
        elif isinstance(value, list):
            value = ", ".join(map(str, value))
        table.add_row(key, str(value))
    console.print(table)
