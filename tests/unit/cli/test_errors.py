"""Every error that a user can cause is one line on stderr with a status, never a traceback."""

import errno
import subprocess
import sys
import time

import pytest
import typer
from typer.testing import CliRunner

from vlnhijack import __version__
from vlnhijack.cli import OneLineErrors, app
from vlnhijack.errors import CheckError, InputError, SetupError

NO_SPACE = OSError(errno.ENOSPC, "No space left on device", "runs/a/texture.exr")


@pytest.mark.parametrize(
    ("error", "line", "status"),
    [
        (
            InputError(file="a.yaml", field="epsilon", expected="a number", received="many"),
            "a.yaml: epsilon: expected a number, received 'many'",
            1,
        ),
        (SetupError("needs\nLLVM"), "needs LLVM", 1),
        (CheckError("apply check failed"), "apply check failed", 1),
        (NO_SPACE, "runs/a/texture.exr: No space left on device", 1),
        (PermissionError(errno.EACCES, "Permission denied", "runs"), "runs: Permission denied", 1),
        (OSError("parquet is cut off"), "parquet is cut off", 1),
        (KeyboardInterrupt(), "interrupted", 130),
    ],
)
def test_one_line(error: BaseException, line: str, status: int) -> None:
    result = CliRunner().invoke(_app_that_raises(error), ["outer", "inner"])
    assert result.stderr == f"vlnhijack: {line}\n"
    assert result.exit_code == status


def test_a_bug_keeps_its_traceback() -> None:
    result = CliRunner().invoke(_app_that_raises(ZeroDivisionError()), ["outer", "inner"])
    assert isinstance(result.exception, ZeroDivisionError)


def test_version() -> None:
    assert CliRunner().invoke(app, ["--version"]).output == f"vlnhijack {__version__}\n"


def test_help_is_quick_and_imports_nothing_heavy() -> None:
    script = (
        "import sys; from vlnhijack.cli import app\n"
        "try: app(['--help'])\n"
        "finally: assert not {'torch', 'mitsuba', 'pandas'} & set(sys.modules), 'heavy import'"
    )
    start = time.perf_counter()
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert "doctor" in done.stdout
    assert "heavy import" not in done.stderr
    assert time.perf_counter() - start < 3, "0.2 s on an idle machine"


def _app_that_raises(error: BaseException) -> typer.Typer:
    outer, inner = typer.Typer(cls=OneLineErrors), typer.Typer()

    @outer.callback()
    @inner.callback()
    def group() -> None:
        pass

    @inner.command("inner")
    def command() -> None:
        raise error

    outer.add_typer(inner, name="outer")
    return outer
