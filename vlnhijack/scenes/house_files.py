"""A house on disk.

house.json                  name, kind, exposure, lights, rooms, surfaces, SHA-256 of every mesh
                            and texture
objects.json                attackable objects
<name>_connectivity.json    navigation graph in Matterport3D's form
meshes/*.ply  textures/*.png
scene.xml  scene.glb        the same house for stock Mitsuba and for glTF viewers
episodes/*.json             R2R-form episodes, one file per split
"""

import re
import shutil
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from vlnhijack import display
from vlnhijack.artifacts import (
    atomic_folder,
    read_json,
    require_replaceable,
    sha256,
    validated,
    write_json,
    write_text,
)
from vlnhijack.errors import InputError
from vlnhijack.navigation.graph import load_graph, save_graph
from vlnhijack.scenes.gltf import save_glb
from vlnhijack.scenes.house import House, HouseObject, Light, Room
from vlnhijack.scenes.mitsuba_xml import mesh_path, scene_xml, texture_paths
from vlnhijack.scenes.ply import read_ply, write_ply
from vlnhijack.scenes.surface import Surface, Wrap

T = TypeVar("T")
_STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)
HOUSE_FILE = "house.json"
_NAME = re.compile(r"[A-Za-z0-9_-]+")


class _SurfaceEntry(BaseModel):
    model_config = _STRICT
    name: str
    mesh: str
    texture: str
    object: str | None
    wrap: Wrap = "clamp"


class _HouseFile(BaseModel):
    model_config = _STRICT
    format: Literal[1]
    name: Annotated[str, Field(pattern=f"^{_NAME.pattern}$")]
    kind: Literal["baked", "lit"]
    exposure: Annotated[float, Field(gt=0)]
    lights: tuple[Light, ...]
    rooms: tuple[Room, ...]
    surfaces: tuple[_SurfaceEntry, ...]
    sha256: dict[str, str]


_HOUSE = TypeAdapter(_HouseFile)
_OBJECTS: TypeAdapter[tuple[HouseObject, ...]] = TypeAdapter(
    tuple[HouseObject, ...], config=_STRICT
)


def check_name(name: str, file: Path) -> None:
    """InputError where a name cannot be that of a house or surface: it becomes a file's."""
    if not _NAME.fullmatch(name):
        raise InputError(
            file=file, field="name", expected="letters, digits, _ and -", received=name
        )


def save_house(
    house: House, folder: Path, episodes: Mapping[str, list[dict[str, Any]]] | None = None
) -> None:
    """Write a house as a whole or not at all; textures are rounded to 8 bits.

    episodes: split → R2R-form records; None keeps those that the folder holds. Raises InputError
    where names or objects are inconsistent, and where the folder holds other files than a house.
    """
    require_replaceable(folder, HOUSE_FILE)
    _check(house, folder)
    with atomic_folder(folder) as new:
        hashes: dict[str, str] = {}
        textures = texture_paths(house)
        for surface in house.surfaces:
            mesh, texture = mesh_path(surface), textures[surface.name]
            write_ply(new / mesh, surface.vertices, surface.faces, surface.uv)
            if texture not in hashes:
                write_texture(new / texture, surface.texture)
            hashes |= {path: sha256(new / path) for path in (mesh, texture) if path not in hashes}
        write_json(new / HOUSE_FILE, _entry(house, hashes).model_dump())
        write_json(new / "objects.json", _OBJECTS.dump_python(house.objects))
        save_graph(house.graph, new)
        write_text(new / "scene.xml", scene_xml(house))
        save_glb(house, new / "scene.glb")
        if episodes is None and (folder / "episodes").is_dir():
            shutil.copytree(folder / "episodes", new / "episodes")
        for split, records in (episodes or {}).items():
            write_json(new / "episodes" / f"{split}.json", records)


def load_house(folder: Path) -> House:
    """Read a house; textures are exactly uint8 / 255.

    Raises InputError that names the file and field where anything is missing, corrupt or
    inconsistent, or lies outside the folder.
    """
    entry = _read(_HOUSE, folder / HOUSE_FILE)
    textures = _load_textures(folder, entry)
    house = House(
        name=entry.name,
        kind=entry.kind,
        surfaces=tuple(
            _load_surface(folder, surface, entry.sha256, textures) for surface in entry.surfaces
        ),
        objects=_read(_OBJECTS, folder / "objects.json"),
        rooms=entry.rooms,
        graph=load_graph(folder, entry.name),
        lights=entry.lights,
        exposure=entry.exposure,
    )
    _check(house, folder)
    return house


def write_texture(path: Path, texture: NDArray[np.float32]) -> None:
    """Write display values (H,W,3) as an 8-bit PNG."""
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(display.to_8bit(texture)).save(path, optimize=True)


def read_texture(path: Path) -> NDArray[np.float32]:
    """Read an 8-bit RGB PNG as display values (H,W,3); raises InputError where it is none."""
    try:
        with Image.open(path) as image:
            if image.format != "PNG" or image.mode != "RGB":
                received = f"{image.format} {image.mode}"
                raise InputError(file=path, expected="an 8-bit RGB PNG", received=received)
            return display.from_8bit(np.asarray(image))
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise InputError(file=path, expected="an 8-bit RGB PNG", received=error) from None


def _entry(house: House, hashes: dict[str, str]) -> _HouseFile:
    textures = texture_paths(house)
    surfaces = tuple(
        _SurfaceEntry(
            name=s.name,
            mesh=mesh_path(s),
            texture=textures[s.name],
            object=s.object_id,
            wrap=s.wrap,
        )
        for s in house.surfaces
    )
    return _HouseFile(
        format=1,
        name=house.name,
        kind=house.kind,
        exposure=house.exposure,
        lights=house.lights,
        rooms=house.rooms,
        surfaces=surfaces,
        sha256=hashes,
    )


def _read(form: TypeAdapter[T], path: Path) -> T:
    return validated(form, read_json(path), path)


def _load_textures(folder: Path, entry: _HouseFile) -> dict[str, NDArray[np.float32]]:
    """Each texture once, by its path in the folder."""
    paths = dict.fromkeys(surface.texture for surface in entry.surfaces)
    return {path: read_texture(_verified(folder, path, entry.sha256)) for path in paths}


def _load_surface(
    folder: Path,
    entry: _SurfaceEntry,
    hashes: dict[str, str],
    textures: dict[str, NDArray[np.float32]],
) -> Surface:
    mesh = read_ply(_verified(folder, entry.mesh, hashes))
    return Surface(entry.name, *mesh, textures[entry.texture], entry.object, entry.wrap)


def _verified(folder: Path, relative: str, hashes: dict[str, str]) -> Path:
    """The path of a mesh or texture that is inside the folder and has its recorded hash."""
    path = folder / relative
    if not path.resolve().is_relative_to(folder.resolve()):
        raise InputError(
            file=folder / HOUSE_FILE,
            field="surfaces",
            expected="paths inside the house folder",
            received=relative,
        )
    if not path.is_file():
        raise InputError(file=path, expected="a file of the house", received="no such file")
    if sha256(path) != hashes.get(relative):
        raise InputError(
            file=path,
            field="sha256",
            expected=hashes.get(relative, f"an entry in {HOUSE_FILE}"),
            received=sha256(path),
        )
    return path


def _check(house: House, folder: Path) -> None:
    names = [surface.name for surface in house.surfaces]
    owners = sorted(s.object_id for s in house.surfaces if s.object_id is not None)
    shared = {o.id for o in house.objects if not o.unwrapped}
    owners = sorted({*owners} & shared) + [name for name in owners if name not in shared]
    objects = sorted(shared) + sorted(o.id for o in house.objects if o.unwrapped)
    own = Counter(id(surface.texture) for surface in house.surfaces)
    leaking = [
        s.name
        for s in house.surfaces
        if s.object_id in set(objects) - shared and (own[id(s.texture)] > 1 or s.wrap != "clamp")
    ]
    rooms = {room.id for room in house.rooms}
    strangers = sorted({o.room for o in house.objects} - rooms)
    for name in (house.name, *names):
        check_name(name, folder)
    for wrong, field, expected, received in (
        (not names, "surfaces", "≥ 1 surface", 0),
        (len(set(names)) < len(names), "surfaces", "distinct names", _repeated(names)),
        (owners != objects, "objects", f"one surface for each of {objects}", owners),
        (leaking, "textures", "one of its own, clamped, for each unwrapped object", leaking),
        (strangers, "objects", f"rooms among {sorted(rooms)}", strangers),
        (house.graph.scan != house.name, "graph", house.name, house.graph.scan),
    ):
        if wrong:
            raise InputError(file=folder, field=field, expected=expected, received=received)


def _repeated(names: list[str]) -> list[str]:
    return sorted({name for name in names if names.count(name) > 1})
