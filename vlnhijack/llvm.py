"""Finds a libLLVM that Dr.Jit can use, before Dr.Jit looks for one itself.

Mitsuba's llvm variants need LLVM 16 or later; with 14 or 15 the first path-type integrator aborts
the whole process ("Cannot select … fminimum"). Nothing here imports Mitsuba or starts a kernel.
"""

import ctypes
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from vlnhijack.errors import SetupError

MINIMUM = 16
VARIABLE = "DRJIT_LIBLLVM_PATH"
FIX = (
    "brew install llvm"
    if sys.platform == "darwin"
    else "apt-get install libllvm19 (or any from libllvm16 on; conda: libllvm19)"
)
FOLDERS = (
    "/usr/lib/llvm-*/lib",
    "/usr/lib/*-linux-gnu",
    "/usr/lib64",
    "/usr/lib64/llvm*/lib*",
    "/usr/lib",
    "/usr/local/lib",
    "/opt/homebrew/opt/llvm*/lib",
    "/usr/local/opt/llvm*/lib",
)
LIBRARY = re.compile(r"libLLVM[-.\d]*\.(so|dylib)[.\d]*$")


@dataclass(frozen=True)
class Llvm:
    """A library file and its major version; 0 stands for a version too old to tell itself."""

    path: Path
    version: int


def require_llvm() -> Llvm:
    """The LLVM that Dr.Jit will load; call it before mitsuba or drjit is imported.

    Importing them loads the library, so DRJIT_LIBLLVM_PATH, set here, has no effect later. A path
    that the user has set there is kept. Raises SetupError, with the fix, where the library is
    missing or older than 16.
    """
    chosen = os.environ.get(VARIABLE)
    if chosen and not Path(chosen).is_file():
        raise SetupError(f"{VARIABLE}={chosen} is no file; unset it, or: {FIX}")
    found = [inspect(Path(chosen))] if chosen else [inspect(path) for path in candidates()]
    best = max(found, key=lambda llvm: llvm.version, default=None)
    if best is None or best.version < MINIMUM:
        seen = ", ".join(sorted({f"{llvm.version or 'an old one'}" for llvm in found})) or "none"
        where, fix = (f" at {VARIABLE}={chosen}", f"unset it, or: {FIX}") if chosen else ("", FIX)
        raise SetupError(f"needs libLLVM >= {MINIMUM}, found {seen}{where}; fix: {fix}")
    os.environ[VARIABLE] = str(best.path)
    return best


def candidates() -> Iterator[Path]:
    """Every libLLVM of the usual folders, the environment's and the linker's cache, once each."""
    seen: set[Path] = set()
    for path in (*_from_folders(), *_from_ldconfig()):
        real = path.resolve()
        if LIBRARY.fullmatch(path.name) and real.is_file() and real not in seen:
            seen.add(real)
            yield path


def inspect(path: Path) -> Llvm:
    """The major version: from the file's name or folder, else from the library itself."""
    real = path.resolve()
    named = re.search(r"libLLVM[-.a-z]*?[-.](\d+)", real.name) or re.search(
        r"/llvm(?:@|-|/)?(\d+)(?=[./])", str(real)
    )
    return Llvm(path, int(named[1]) if named else _loaded_version(path))


def _from_folders() -> Iterator[Path]:
    prefixes = {sys.prefix, os.environ.get("CONDA_PREFIX", sys.prefix)}
    for pattern in (*FOLDERS, *(f"{prefix}/lib" for prefix in sorted(prefixes))):
        yield from sorted(Path("/").glob(f"{pattern.lstrip('/')}/libLLVM*"))


def _from_ldconfig() -> Iterator[Path]:
    for program in ("ldconfig", "/sbin/ldconfig"):
        try:
            listing = subprocess.run([program, "-p"], capture_output=True, text=True, timeout=10)
        except OSError:
            continue
        yield from map(Path, re.findall(r"=> (\S*libLLVM\S*)", listing.stdout))
        return


def _loaded_version(path: Path) -> int:
    """What the library says; LLVMGetVersion exists since LLVM 16."""
    major = ctypes.c_uint(0)
    try:
        ctypes.CDLL(str(path)).LLVMGetVersion(ctypes.byref(major), None, None)
    except (OSError, AttributeError):
        return 0
    return major.value
