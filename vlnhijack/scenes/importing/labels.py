"""Which faces of a mesh file are objects: nodes whose names are things, or a file that says so."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, NonNegativeInt, TypeAdapter

from vlnhijack.artifacts import read_json, validated
from vlnhijack.errors import InputError
from vlnhijack.scenes.house import Room, nearest_room
from vlnhijack.scenes.importing.mesh_file import MeshFile
from vlnhijack.scenes.importing.source_mesh import (
    BACKGROUND,
    SourceMesh,
    SourceObject,
    whole_room,
)
from vlnhijack.scenes.procedural.phrases import OBJECT_WORDS

_STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)
_Name = Annotated[str, Field(pattern="^[A-Za-z0-9_]+$")]
_Range = tuple[NonNegativeInt, NonNegativeInt]

Labelled = tuple[SourceMesh, tuple[Room, ...]]


class _Object(BaseModel):
    model_config = _STRICT
    id: _Name
    category: Annotated[str, Field(min_length=1)]
    room: str | None = None
    node: str | None = None
    faces: tuple[_Range, ...] | None = None


class _Labels(BaseModel):
    model_config = _STRICT
    objects: tuple[_Object, ...] | None = None
    rooms: tuple[Room, ...] = ()


_LABELS = TypeAdapter(_Labels)


def label_by_name(read: MeshFile, rooms: tuple[Room, ...] = ()) -> Labelled:
    """Objects are the nodes whose names hold a word for one, such as Office_Chair.003.

    A node belongs to the nearest of itself and its ancestors with such a word, and on to a parent
    with a word for the same thing; to the background if there is none. An object is in the room
    nearest to its centre; without rooms, the mesh is one.
    """
    rooms = rooms or (whole_room(read.mesh),)
    named = [_named(node) for node in read.nodes]
    owners = list(dict.fromkeys(owner for owner in named if owner is not None))
    rank = [BACKGROUND if owner is None else owners.index(owner) for owner in named]
    face_object = np.array(rank, np.int32)[read.face_node]
    numbers: Counter[str] = Counter()
    objects = []
    for row, (_, category) in enumerate(owners):
        room = _room_of(read.mesh, face_object == row, rooms)
        objects.append(SourceObject(f"{category}_{numbers[category]:02d}", category, room))
        numbers[category] += 1
    return replace(read.mesh, face_object=face_object, objects=tuple(objects)), rooms


def label_by_file(read: MeshFile, file: Path) -> Labelled:
    """Objects and rooms of a JSON file, whose form docs/import.md tells; either may be left out.

    Raises InputError that names the object where its node, faces or room do not exist, or faces
    have two owners.
    """
    labels = validated(_LABELS, read_json(file), file)
    if labels.objects is None:
        return label_by_name(read, labels.rooms)
    rooms = labels.rooms or (whole_room(read.mesh),)
    face_object = np.full(len(read.mesh.faces), BACKGROUND, np.int32)
    for number, entry in enumerate(labels.objects):
        rows = _faces(read, entry, file)
        taken = face_object[rows] != BACKGROUND
        if taken.any():
            other = labels.objects[face_object[rows[taken][0]]].id
            _refuse(file, entry, "faces", "faces of one object", f"some of {other} too")
        face_object[rows] = number
    mesh = read.mesh
    objects = tuple(
        SourceObject(e.id, e.category, _room(mesh, face_object == number, e, rooms, file))
        for number, e in enumerate(labels.objects)
    )
    return replace(mesh, face_object=face_object, objects=objects), rooms


def _named(node: Sequence[str]) -> tuple[str, str] | None:
    """The node or ancestor that is an object (the whole, not its parts), and its category."""
    categories = [_category(name) for name in node]
    found = next((row for row, category in enumerate(categories) if category is not None), None)
    if found is None:
        return None
    while categories[found + 1 : found + 2] == [categories[found]]:
        found += 1
    return node[found], str(categories[found])


def _category(name: str) -> str | None:
    """The category of the longest word for an object in a node's name; the last of them."""
    split = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)
    words = " ".join(re.findall(r"[a-z]+", split.lower()))
    found = [
        (len(word), match.end(), category)
        for word, category in OBJECT_WORDS.items()
        for match in re.finditer(rf"\b{word}\b", words)
    ]
    return max(found)[2] if found else None


def _faces(read: MeshFile, entry: _Object, file: Path) -> NDArray[np.int64]:
    """Rows of the faces of an object: those of its node, or the ranges among them."""
    if entry.node is None and entry.faces is None:
        _refuse(file, entry, "node", "a node or faces", "neither")
    rows = np.arange(len(read.face_node))
    if entry.node is not None:
        mine = [row for row, names in enumerate(read.nodes) if entry.node in names]
        rows = np.flatnonzero(np.isin(read.face_node, mine))
        if len(rows) == 0:
            names = ", ".join(sorted({node[0] for node in read.nodes}))
            _refuse(file, entry, "node", f"one of {names}", entry.node)
    if entry.faces is None:
        return rows
    parts = []
    for first, end in entry.faces:
        if not first < end <= len(rows):
            _refuse(file, entry, "faces", f"first < end ≤ {len(rows)}", (first, end))
        parts.append(rows[first:end])
    return np.unique(np.concatenate(parts)) if parts else rows[:0]


def _room(
    mesh: SourceMesh,
    mine: NDArray[np.bool_],
    entry: _Object,
    rooms: Sequence[Room],
    file: Path,
) -> str:
    """The room that an object names, else the one nearest to its centre."""
    if entry.room is not None:
        if entry.room not in {room.id for room in rooms}:
            _refuse(file, entry, "room", f"one of {[room.id for room in rooms]}", entry.room)
        return entry.room
    if not mine.any():
        _refuse(file, entry, "faces", "≥ 1 face", 0)
    return _room_of(mesh, mine, rooms)


def _room_of(mesh: SourceMesh, mine: NDArray[np.bool_], rooms: Sequence[Room]) -> str:
    """The room nearest to the centre of these faces' box."""
    corners = mesh.vertices[mesh.faces[mine]].reshape(-1, 3)
    x, y = (corners.min(axis=0)[:2] + corners.max(axis=0)[:2]) / 2
    return nearest_room(rooms, x, y).id


def _refuse(file: Path, entry: _Object, field: str, expected: str, received: object) -> None:
    raise InputError(
        file=file, field=f"object {entry.id}: {field}", expected=expected, received=received
    )
