"""Resident memory of this process, without the freed memory that Dr.Jit keeps for later."""

import gc
from pathlib import Path

from vlnhijack.errors import SetupError
from vlnhijack.rendering.variant import activate

_PROCESS = Path("/proc/self")


def restart_peak() -> float:
    """Give unused memory back and start a new peak; resident megabytes (10⁶ bytes).

    Raises SetupError where the system is no Linux or forbids it.
    """
    activate()
    import drjit as dr

    gc.collect()
    dr.sync_thread()
    dr.flush_malloc_cache()
    try:
        (_PROCESS / "clear_refs").write_text("5")
    except OSError as error:
        raise SetupError(f"memory is measured by {_PROCESS}/clear_refs: {error}") from None
    return _megabytes("VmRSS")


def peak() -> float:
    """The largest resident megabytes since `restart_peak`."""
    return _megabytes("VmHWM")


def _megabytes(field: str) -> float:
    lines = (_PROCESS / "status").read_text().splitlines()
    kibibytes = next(line.split()[1] for line in lines if line.startswith(field))
    return int(kibibytes) * 1024 / 1e6
