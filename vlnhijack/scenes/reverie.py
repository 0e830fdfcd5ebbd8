"""REVERIE's object annotations: which objects a viewpoint shows, and in which box of each view."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from vlnhijack.artifacts import stream_json_object, validated
from vlnhijack.errors import InputError
from vlnhijack.navigation.graph import NavigationGraph
from vlnhijack.navigation.views import VIEWS

WIDTH, HEIGHT = 640, 480

Box = Annotated[list[Annotated[int, Field(ge=0)]], Field(min_length=4, max_length=4)]
_View = Annotated[int, Field(ge=0, lt=VIEWS)]


@dataclass(frozen=True)
class Sighting:
    """An object as it appears at a viewpoint.

    name: the annotator's word for it; boxes: view index → x, y, width, height in pixels of the
    640 × 480 view. Object ids are unique within a scan.
    """

    scan: str
    viewpoint: str
    object_id: str
    name: str
    boxes: Mapping[int, tuple[int, int, int, int]]

    @property
    def largest(self) -> float:
        """The largest share of a view that a box of the object covers; 0 without boxes."""
        areas = [width * height for _, _, width, height in self.boxes.values()]
        return max(areas, default=0) / (WIDTH * HEIGHT)


class _Object(BaseModel):
    model_config = ConfigDict(strict=True)
    name: Annotated[str, Field(pattern=r"\S")]
    visible_pos: list[_View]
    bbox2d: list[Box]


_ENTRY = TypeAdapter(dict[str, _Object])


def stream_sightings(source: Path, graphs: Mapping[str, NavigationGraph]) -> Iterator[Sighting]:
    """The sightings of REVERIE's `BBox` folder, or of one .json(.gz) file of all its entries.

    The folder holds `<scan>_<viewpoint>.json` files of {viewpoint: {object id: …}}; the one file
    {"<scan>_<viewpoint>": {object id: …}}; an object {"name", "visible_pos", "bbox2d"}. Entries are
    read one at a time. Raises InputError with file, entry and field for wrong types, unknown
    viewpoints, viewpoints and objects that come twice, boxes outside their view, and lists that do
    not match.
    """
    if source.is_dir():
        files = sorted(source.glob("*.json"))
        if not files:
            raise InputError(file=source, expected="<scan>_<viewpoint>.json files", received="none")
    else:
        files = [source]
    for file in files:
        for key, value in stream_json_object(file):
            objects = validated(_ENTRY, value, file, key)
            whole = file.stem if source.is_dir() else key
            scan, viewpoint = _split(file, whole, graphs)
            if source.is_dir() and viewpoint != key:
                raise InputError(file=file, field=key, expected=viewpoint, received=key)
            for object_id, entry in objects.items():
                boxes = _boxes(file, f"{key}: {object_id}", entry)
                name = entry.name.replace("#", " ")
                yield Sighting(scan, viewpoint, object_id, name, boxes)


def _split(file: Path, key: str, graphs: Mapping[str, NavigationGraph]) -> tuple[str, str]:
    """Scan and viewpoint of "<scan>_<viewpoint>", where both may have underscores."""
    parts = key.split("_")
    for cut in range(1, len(parts)):
        scan, viewpoint = "_".join(parts[:cut]), "_".join(parts[cut:])
        if scan in graphs and viewpoint in graphs[scan].index:
            return scan, viewpoint
    raise InputError(
        file=file, field=key, expected="<scan>_<viewpoint> of a known graph", received=key
    )


def _boxes(file: Path, where: str, entry: _Object) -> dict[int, tuple[int, int, int, int]]:
    if len(entry.visible_pos) != len(entry.bbox2d):
        raise InputError(
            file=file,
            field=f"{where}: bbox2d",
            expected=f"{len(entry.visible_pos)} boxes, as many as visible_pos",
            received=len(entry.bbox2d),
        )
    boxes: dict[int, tuple[int, int, int, int]] = {}
    for view, (x, y, width, height) in zip(entry.visible_pos, entry.bbox2d, strict=True):
        if view in boxes:
            raise InputError(
                file=file, field=f"{where}: visible_pos", expected="distinct views", received=view
            )
        if x + width > WIDTH or y + height > HEIGHT:
            raise InputError(
                file=file,
                field=f"{where}: bbox2d",
                expected=f"a box inside {WIDTH} × {HEIGHT} pixels",
                received=[x, y, width, height],
            )
        boxes[view] = (x, y, width, height)
    return boxes
