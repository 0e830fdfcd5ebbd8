"""The command line: `vlnhijack --help`. Torch and Mitsuba are imported inside the commands only."""

import sys
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from vlnhijack import __version__
from vlnhijack.cli import agent, bench, doctor, house
from vlnhijack.cli.instances import instances
from vlnhijack.cli.run import run
from vlnhijack.errors import VlnHijackError


class OneLineErrors(TyperGroup):
    """Errors that a user can cause end in one line on stderr and a non-zero status."""

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except VlnHijackError as error:
            message, status = str(error), 1
        except BrokenPipeError:
            raise
        except OSError as error:
            message, status = _describe(error), 1
        except KeyboardInterrupt:
            message, status = "interrupted", 130
        print(f"vlnhijack: {' '.join(message.split())}", file=sys.stderr)
        raise typer.Exit(status)


def _describe(error: OSError) -> str:
    if error.strerror is None:
        return str(error) or type(error).__name__
    return f"{error.filename}: {error.strerror}" if error.filename else error.strerror


app = typer.Typer(
    cls=OneLineErrors,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Hijack vision-and-language navigation agents by the texture of one object.",
)
app.command()(run)
app.command()(instances)
app.add_typer(house.app, name="house")
app.add_typer(agent.app, name="agent")
app.add_typer(bench.app, name="bench")
app.command()(doctor.doctor)


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"vlnhijack {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    pass


def main() -> None:
    """The console script."""
    app(prog_name="vlnhijack")
