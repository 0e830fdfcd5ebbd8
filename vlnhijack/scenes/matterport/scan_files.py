"""Where the files of a scan are: in its folder, or packed in it as they are handed out."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from vlnhijack.errors import InputError
from vlnhijack.scenes.matterport.archive import unpack

MESH, SEGMENTATION = "matterport_mesh", "house_segmentations"


@dataclass(frozen=True)
class ScanFiles:
    """name: of the scan; mesh: its .obj; segmentation: the folder of <name>.house, .ply, .json."""

    name: str
    mesh: Path
    segmentation: Path


@contextmanager
def scan_files(scan: Path) -> Iterator[ScanFiles]:
    """The files of a scan's folder; those of .zip archives are unpacked for the block.

    Raises InputError where a part is missing, a part has no or several .obj or .house files, or an
    archive is broken or points outside.
    """
    with tempfile.TemporaryDirectory(prefix="vlnhijack-") as scratch:
        mesh = _only(_part(scan, MESH, Path(scratch)), "*.obj")
        house = _only(_part(scan, SEGMENTATION, Path(scratch)), "*.house")
        yield ScanFiles(house.stem, mesh, house.parent)


def _part(scan: Path, name: str, scratch: Path) -> Path:
    archive = scan / f"{name}.zip"
    if (scan / name).is_dir():
        return scan / name
    if not archive.is_file():
        raise InputError(file=scan, expected=f"{name} or {name}.zip", received="neither of them")
    unpack(archive, scratch / name)
    return scratch / name


def _only(folder: Path, pattern: str) -> Path:
    found = sorted(path for path in folder.rglob(pattern) if path.is_file())
    if len(found) != 1:
        raise InputError(
            file=folder,
            expected=f"one {pattern} file",
            received=", ".join(path.name for path in found) or "none",
        )
    return found[0]
