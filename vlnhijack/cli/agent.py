"""`vlnhijack agent`: train the small agent, measure it."""

from pathlib import Path
from typing import Annotated

import typer

from vlnhijack.cli.console import console, progress_bars

app = typer.Typer(no_args_is_help=True, help="Train the small agent, or measure it.")


@app.command()
def train(
    config: Annotated[Path, typer.Argument(help="experiments/small_agent.yaml or your own.")],
    out: Annotated[Path | None, typer.Option(help="Run folder; runs/<name> by default.")] = None,
    override: Annotated[list[str] | None, typer.Option("--set", help="key=value")] = None,
) -> None:
    """Train an agent; an interrupted training goes on where it was."""
    from vlnhijack.experiments.train_agent import AgentConfig, train_agent
    from vlnhijack.experiments.yaml_config import load_config

    settings = load_config(config, AgentConfig, override or [])
    with progress_bars() as progress:
        agent = train_agent(settings, out or Path("runs") / settings.name, progress)
    console.print(f"weights: {agent.path}")
    _print_rates(agent.metadata)


@app.command("eval")
def evaluate(
    agent: Annotated[
        str, typer.Argument(help="A shipped agent, or a .safetensors file.")
    ] = "small",
    spp: Annotated[int, typer.Option(help="Samples per pixel.")] = 16,
    seed: Annotated[int, typer.Option()] = 1,
    record: Annotated[
        list[str] | None,
        typer.Option(help="Measure this house alone and store its rates with the weights."),
    ] = None,
) -> None:
    """Measure the clean agent on freshly rendered views, with the ablations."""
    from vlnhijack.experiments.agent_eval import evaluate_agent, record_rates

    with progress_bars() as progress:
        if record:
            measured = {"val_seen_by_house": record_rates(agent, record, spp, seed, progress)}
        else:
            measured = evaluate_agent(agent, spp, seed, progress)
    _print_rates(measured)


def _print_rates(measured: dict) -> None:
    from rich.table import Table

    table = Table(title="clean agent, %")
    for column in ("episodes", "n", "SR", "OSR", "SPL", "nDTW"):
        table.add_column(column, justify="left" if column == "episodes" else "right")
    seen = {**measured.get("val_seen", {}), **measured["val_seen_by_house"]}
    rows = {f"val_seen, {name}": rates for name, rates in seen.items()}
    rows |= {key: measured[key] for key in ("val_unseen",) if key in measured}
    for name, rates in rows.items():
        values = (f"{100 * rates[key]:.1f}" for key in ("sr", "osr", "spl", "ndtw"))
        table.add_row(name, str(rates["n"]), *values)
    console.print(table)
