"""Options that a renderer cannot follow are refused before any work."""

import pytest
from typer.testing import CliRunner

from vlnhijack.cli import app


@pytest.mark.parametrize("command", [["agent", "eval"], ["house", "make", "cabin"]])
def test_there_is_at_least_one_sample(command: list[str]) -> None:
    done = CliRunner().invoke(app, [*command, "--spp", "0"])
    assert done.exit_code == 2
    assert "--spp" in done.stderr and "greater than or equal to 1" in done.stderr


def test_samples_of_a_pixel_form_a_square() -> None:
    done = CliRunner().invoke(app, ["agent", "eval", "--house", "alder", "--spp", "3"])
    assert done.exit_code == 1
    assert done.stderr.endswith("vlnhijack: spp: expected a square number, received 3\n")


def test_a_rate_is_recorded_for_a_house() -> None:
    done = CliRunner().invoke(app, ["agent", "eval", "--record"])
    assert done.exit_code == 1
    assert "record: expected a --house to record" in done.stderr
