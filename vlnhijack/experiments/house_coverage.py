"""How many pixels of each view every object of a house fills, kept with the house."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, PositiveInt, TypeAdapter

from vlnhijack.artifacts import read_json, sha256, validated, write_json
from vlnhijack.errors import InputError
from vlnhijack.experiments.views import Advance
from vlnhijack.navigation.views import VIEWS, panorama_cameras
from vlnhijack.rendering.coverage import object_pixels
from vlnhijack.scenes.house import House

FILE = "coverage.json"
WIDTH, HEIGHT = 640, 480


@dataclass(frozen=True, eq=False)
class HouseCoverage:
    """pixels (M,36,O) int32 of the objects in views of width × height pixels."""

    pixels: NDArray[np.int32]
    width: int
    height: int

    @property
    def shares(self) -> NDArray[np.float32]:
        """Share (M,36,O) of every view."""
        return (self.pixels / (self.width * self.height)).astype(np.float32)


_View = Annotated[int, Field(ge=0, lt=VIEWS)]
_Count = Annotated[int, Field(gt=0, lt=1 << 31)]


class _File(BaseModel):
    """pixels: viewpoint → object → view → count, without zeros; sha256: what was measured."""

    model_config = ConfigDict(extra="forbid")
    format: Literal[1]
    width: PositiveInt
    height: PositiveInt
    sha256: dict[str, str]
    pixels: dict[str, dict[str, dict[_View, _Count]]]


_FILE = TypeAdapter(_File)


def measure_coverage(folder: Path, house: House, advance: Advance) -> HouseCoverage:
    """Count the pixels of all 36·M views of 640 × 480 and write `coverage.json` into the folder.

    One ray a pixel: those of `FrozenRenderer(house, object, panorama_cameras(…), spp=1)`, the sums
    of whose rows are these counts. advance is told of the views that are done.
    """
    pixels = np.zeros((len(house.graph.viewpoints), VIEWS, len(house.objects)), np.int32)
    for row, (x, y, z) in enumerate(house.graph.positions.tolist()):
        pixels[row] = object_pixels(house, panorama_cameras((x, y, z), WIDTH, HEIGHT))
        advance(VIEWS)
    file = {
        "format": 1,
        "width": WIDTH,
        "height": HEIGHT,
        "sha256": _measured(folder, house),
        "pixels": _sparse(house, pixels),
    }
    write_json(folder / FILE, file)
    return HouseCoverage(pixels, WIDTH, HEIGHT)


def load_coverage(folder: Path, house: House) -> HouseCoverage | None:
    """What `measure_coverage` wrote into the folder, or None.

    Raises InputError where the file is broken or was measured before the house was changed.
    """
    path = folder / FILE
    if not path.exists():
        return None
    file = validated(_FILE, read_json(path), path)
    if file.sha256 != _measured(folder, house):
        raise InputError(
            "stale, measure it again (vlnhijack house coverage)",
            file=path,
            field="sha256",
            expected="the files of the house as they are",
            received="others",
        )
    return HouseCoverage(_dense(path, house, file), file.width, file.height)


def _dense(path: Path, house: House, file: _File) -> NDArray[np.int32]:
    pixels = np.zeros((len(house.graph.viewpoints), VIEWS, len(house.objects)), np.int32)
    columns = {thing.id: column for column, thing in enumerate(house.objects)}
    for viewpoint, objects in file.pixels.items():
        for object_id, views in objects.items():
            if viewpoint not in house.graph.index or object_id not in columns:
                raise InputError(
                    file=path,
                    field="pixels",
                    expected="viewpoints and objects of the house",
                    received=f"{viewpoint}, {object_id}",
                )
            row, column = house.graph.index[viewpoint], columns[object_id]
            pixels[row, list(views), column] = list(views.values())
    return pixels


def _measured(folder: Path, house: House) -> dict[str, str]:
    names = ("house.json", "objects.json", f"{house.name}_connectivity.json")
    return {name: sha256(folder / name) for name in names}


def _sparse(house: House, pixels: NDArray[np.int32]) -> dict[str, dict[str, dict[int, int]]]:
    found: dict[str, dict[str, dict[int, int]]] = {}
    for row, column, view in np.argwhere(pixels.transpose(0, 2, 1)).tolist():
        objects = found.setdefault(house.graph.viewpoints[row], {})
        objects.setdefault(house.objects[column].id, {})[view] = int(pixels[row, view, column])
    return found
