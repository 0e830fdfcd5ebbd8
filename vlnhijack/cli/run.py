"""`vlnhijack run`: an experiment file from beginning to end."""

from pathlib import Path
from typing import Annotated

import typer

from vlnhijack.cli.console import console, progress_bars


def run(
    experiment: Annotated[Path, typer.Argument(help="Experiment file (YAML).")],
    out: Annotated[Path | None, typer.Option(help="Run folder; runs/<name> by default.")] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue the run in the folder, if there is one.")
    ] = False,
    override: Annotated[
        list[str] | None, typer.Option("--set", help="key=value, for example attack.epsilon=0.1")
    ] = None,
) -> None:
    """Attack, export, evaluate, and print the table."""
    from vlnhijack.experiments.config import ExperimentConfig
    from vlnhijack.experiments.runner import print_summary, run
    from vlnhijack.experiments.yaml_config import load_config

    config = load_config(experiment, ExperimentConfig, override or [])
    folder = out or Path("runs") / config.name
    with progress_bars() as progress:
        run(config, folder, resume=resume, progress=progress)
    print_summary(console, config, folder)
