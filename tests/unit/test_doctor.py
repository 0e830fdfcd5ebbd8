from importlib import metadata

import pytest
from packaging.requirements import Requirement
from typer.testing import CliRunner

from vlnhijack import doctor
from vlnhijack.cli import app
from vlnhijack.errors import SetupError
from vlnhijack.llvm import Llvm


@pytest.fixture(autouse=True)
def no_kernels(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "_probe", lambda variant: "" if "llvm" in variant else "no GPU")


def test_an_old_llvm_is_named_with_its_fix(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse() -> Llvm:
        raise SetupError("needs libLLVM >= 16, found 15; fix: apt-get install libllvm19")

    monkeypatch.setattr(doctor, "require_llvm", refuse)
    finding = next(row for row in doctor.examine() if row.name == "libLLVM")
    assert not finding.ok
    assert finding.found == "needs libLLVM >= 16, found 15"
    assert finding.fix == "apt-get install libllvm19"


def test_missing_and_outdated_packages() -> None:
    assert doctor._problem(Requirement("no-such-thing-here>=1")) == "no-such-thing-here is missing"
    assert doctor._problem(Requirement("numpy<1")).startswith(f"numpy {metadata.version('numpy')}")
    assert doctor._problem(Requirement("numpy>=1")) == ""


def test_requirements_are_those_of_the_distribution() -> None:
    plain = {requirement.name for requirement in doctor.requirements()}
    assert {"mitsuba", "torch", "xatlas"} <= plain
    assert "ray" not in plain
    assert [requirement.name for requirement in doctor.requirements("cluster")] == ["ray"]


@pytest.mark.parametrize(("required", "status"), [(True, 1), (False, 0)])
def test_only_required_things_fail(
    monkeypatch: pytest.MonkeyPatch, required: bool, status: int
) -> None:
    row = doctor.Finding("torch", False, "none [there]", "make setup", required)
    monkeypatch.setattr(doctor, "examine", lambda: [row])
    result = CliRunner().invoke(app, ["doctor"])
    assert result.exit_code == status
    assert "none [there]" in result.stdout
    assert "make setup" in result.stdout
