"""Whether a file fits into this machine's memory, before it is read."""

import os
from pathlib import Path

from vlnhijack.errors import InputError

BYTES_PER_BYTE = 12  # of a mesh file: its arrays, their copies and the house
BYTES_PER_PIXEL = 40  # of an image: 8 bits, float32, and the renderer's copy


def require_memory(file: Path, needed: int) -> None:
    """InputError with the estimate where `needed` bytes are more than are available."""
    available = _available()
    if needed > available:
        raise InputError(
            file=file,
            field="memory",
            expected=f"a mesh that fits into {available / 1e9:.1f} GB of free memory",
            received=f"one that takes about {needed / 1e9:.1f} GB",
        )


def _available() -> int:
    meminfo = Path("/proc/meminfo")
    if not meminfo.exists():
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    line = next(line for line in meminfo.read_text().splitlines() if "MemAvailable" in line)
    return int(line.split()[1]) * 1024
