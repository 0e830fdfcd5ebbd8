"""What this machine has and lacks, and how to get what is missing."""

import subprocess
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib import metadata

from packaging.requirements import Requirement

from vlnhijack import settings
from vlnhijack.errors import VlnHijackError
from vlnhijack.llvm import require_llvm

REINSTALL = "make setup, or pip install -c constraints.txt -e ."
CLONE = "git clone the repository and set VLNHIJACK_HOME to it"
VARIANTS = {
    "llvm_ad_rgb": "needs libLLVM >= 16, see above",
    "cuda_ad_rgb": "needs an NVIDIA GPU with driver",
}


@dataclass(frozen=True)
class Finding:
    """One row: what was looked for, whether it is there, what was found, how to get it."""

    name: str
    ok: bool
    found: str
    fix: str = ""
    required: bool = True


def examine() -> list[Finding]:
    """Every finding, required ones first."""
    checks: tuple[Callable[[], Iterable[Finding]], ...] = (
        _python,
        _packages,
        _llvm,
        _variants,
        _torch,
        _houses,
        _weights,
        _extras,
    )
    findings = [finding for check in checks for finding in check()]
    return sorted(findings, key=lambda finding: not finding.required)


def _python() -> Iterable[Finding]:
    version = ".".join(map(str, sys.version_info[:3]))
    yield Finding("python", sys.version_info >= (3, 11), version, "install Python >= 3.11")


def _packages() -> Iterable[Finding]:
    wanted = requirements()
    missing = [problem for problem in map(_problem, wanted) if problem]
    found = ", ".join(missing) or f"{len(wanted)} of {len(wanted)}"
    yield Finding("packages", not missing, found, REINSTALL)


def _llvm() -> Iterable[Finding]:
    try:
        llvm = require_llvm()
        yield Finding("libLLVM", True, f"{llvm.version} ({llvm.path})")
    except VlnHijackError as error:
        found, _, fix = str(error).partition("; fix: ")
        yield Finding("libLLVM", False, found, fix)


def _variants() -> Iterable[Finding]:
    for variant, fix in VARIANTS.items():
        failure = _probe(variant)
        found = failure or f"renders (mitsuba {_version('mitsuba')}, drjit {_version('drjit')})"
        yield Finding(f"variant {variant}", not failure, found, fix, variant == "llvm_ad_rgb")


def _probe(variant: str) -> str:
    """Why the variant does not render here; empty where it does."""
    command = [sys.executable, "-m", "vlnhijack.rendering.probe", variant]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    except subprocess.TimeoutExpired:
        return "no picture after 120 s"
    lines = done.stderr.strip().splitlines() or [f"ended with status {done.returncode}"]
    return lines[-1].partition(". ")[0][:120] if done.returncode else ""


def _torch() -> Iterable[Finding]:
    try:
        import torch
    except (ImportError, OSError) as error:
        yield Finding("torch", False, str(error), REINSTALL)
        return
    device = "cuda" if torch.cuda.is_available() else "cpu"
    found = f"{torch.__version__} on {device}, {torch.get_num_threads()} threads"
    yield Finding("torch", True, found)


def _houses() -> Iterable[Finding]:
    try:
        names = settings.house_names()
        found = f"{', '.join(names) or 'no house'} in {settings.scenes_folder()}"
        yield Finding("houses", bool(names), found, CLONE)
    except VlnHijackError as error:
        yield Finding("houses", False, str(error), CLONE)


def _weights() -> Iterable[Finding]:
    names = sorted(path.name for path in settings.WEIGHTS.glob("*.safetensors"))
    yield Finding("agent weights", bool(names), ", ".join(names) or "none", REINSTALL)


def _extras() -> Iterable[Finding]:
    for extra in metadata.metadata("vlnhijack").get_all("Provides-Extra") or []:
        missing = [problem for problem in map(_problem, requirements(extra)) if problem]
        fix = f"pip install -c constraints.txt -e '.[{extra}]'"
        yield Finding(f"extra {extra}", not missing, ", ".join(missing) or "installed", fix, False)


def requirements(extra: str = "") -> list[Requirement]:
    """The distribution's own requirements, of one extra or of none."""
    wanted = map(Requirement, metadata.requires("vlnhijack") or [])
    return [
        requirement
        for requirement in wanted
        if (requirement.marker is not None) == bool(extra)
        and (requirement.marker is None or requirement.marker.evaluate({"extra": extra}))
    ]


def _problem(requirement: Requirement) -> str:
    version = _version(requirement.name)
    if version is None:
        return f"{requirement.name} is missing"
    if not requirement.specifier.contains(version, prereleases=True):
        return f"{requirement.name} {version} is not {requirement.specifier}"
    return ""


def _version(distribution: str) -> str | None:
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return None
