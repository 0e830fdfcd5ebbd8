"""A scan in Matterport3D's layout for tests: the tiny house, exported, plain or packed."""

import shutil
from pathlib import Path

from rich.progress import Progress

from tests.houses import tiny_house
from vlnhijack.experiments.import_house import ImportOptions
from vlnhijack.experiments.import_scan import import_scan
from vlnhijack.scenes.importing.mesh_file import ReadOptions
from vlnhijack.scenes.matterport.export import export_scan


def tiny_scan(folder: Path) -> Path:
    """The folder of the scan; its graph is in `connectivity` beside it."""
    return export_scan(tiny_house(), folder, [])


def pack(scan: Path) -> None:
    """Put the parts of a scan into archives, as they are handed out."""
    for part in sorted(path for path in scan.iterdir() if path.is_dir()):
        inside = scan / "packed" / scan.name
        inside.mkdir(parents=True)
        part.rename(inside / part.name)
        shutil.make_archive(str(part), "zip", scan / "packed")
        shutil.rmtree(scan / "packed")


def import_quietly(scan: Path, folder: Path, *, allow_missing: bool = False) -> list[str]:
    """`import_scan` without progress bars, with the graph beside the scan."""
    options = ImportOptions(ReadOptions(up="z", allow_missing=allow_missing))
    with Progress(disable=True) as progress:
        return import_scan(scan, scan.parent / "connectivity", folder, options, progress)
