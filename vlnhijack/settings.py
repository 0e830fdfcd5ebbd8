"""Where the shipped data lies: houses in `<root>/scenes`, experiments in `<root>/experiments`."""

import os
from pathlib import Path

from vlnhijack.errors import InputError, SetupError

PACKAGE = Path(__file__).resolve().parent
WEIGHTS = PACKAGE / "agents" / "weights"
SCENE_FILE = "scene.xml"


def data_root() -> Path:
    """The folder named by VLNHIJACK_HOME, else the clone that the package is installed from.

    Raises InputError where VLNHIJACK_HOME is no folder, SetupError where there is no clone.
    """
    home = os.environ.get("VLNHIJACK_HOME")
    if home:
        root = Path(home).expanduser().resolve()
        if not root.is_dir():
            raise InputError(field="VLNHIJACK_HOME", expected="an existing folder", received=home)
        return root
    clone = PACKAGE.parent
    if not (clone / "pyproject.toml").is_file():
        raise SetupError(
            "no data folder: set VLNHIJACK_HOME to a clone of vlnhijack, which holds scenes/"
        )
    return clone


def scenes_folder() -> Path:
    return data_root() / "scenes"


def experiments_folder() -> Path:
    return data_root() / "experiments"


def house_names() -> list[str]:
    """The houses of the data root, sorted: folders that hold a scene.xml."""
    return sorted(path.parent.name for path in scenes_folder().glob(f"*/{SCENE_FILE}"))


def house_folder(name: str | Path) -> Path:
    """The folder of a house given by its path or by its name in the data root.

    Raises InputError where there is no such house.
    """
    for folder in (Path(name), scenes_folder() / name):
        if (folder / SCENE_FILE).is_file():
            return folder.resolve()
    known = ", ".join(house_names()) or "none there"
    raise InputError(
        field="house",
        expected=f"a folder with {SCENE_FILE}, or a house of {scenes_folder()} ({known})",
        received=str(name),
    )
