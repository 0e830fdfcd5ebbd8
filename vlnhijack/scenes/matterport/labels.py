"""The objects and rooms of a scan's `.house` file on its textured mesh."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vlnhijack.scenes.categories import STRUCTURE
from vlnhijack.scenes.house import Room, nearest_room
from vlnhijack.scenes.importing.source_mesh import (
    BACKGROUND,
    SourceMesh,
    SourceObject,
    whole_room,
)
from vlnhijack.scenes.matterport.house_file import HouseFile, Region, ScanObject
from vlnhijack.scenes.matterport.regions import LABELS


def label(
    mesh: SourceMesh, listed: HouseFile, face_object: NDArray[np.int32]
) -> tuple[SourceMesh, tuple[Room, ...], list[int]]:
    """The mesh with its objects, the rooms, and the numbers of objects that have no face.

    face_object (F,) holds numbers of `listed.objects`, -1 for none. An object's id is its number,
    as in REVERIE, its category that of mpcat40. Walls, floors and other structure are background.
    """
    things = [i for i in range(len(listed.objects)) if listed.category(i).mpcat40 not in STRUCTURE]
    faces = np.bincount(face_object + 1, minlength=len(listed.objects) + 1)[1:]
    kept = [number for number in things if faces[number]]
    rank = np.full(len(listed.objects) + 1, BACKGROUND, np.int32)
    rank[kept] = np.arange(len(kept))
    rooms = _rooms(mesh, listed.regions)
    objects = tuple(
        SourceObject(str(i), listed.category(i).mpcat40, _room(listed.objects[i], rooms))
        for i in kept
    )
    labelled = replace(mesh, face_object=rank[face_object], objects=objects)
    return labelled, rooms, [number for number in things if not faces[number]]


def _rooms(mesh: SourceMesh, regions: Sequence[Region]) -> tuple[Room, ...]:
    """The regions, or one room as large as the mesh."""
    if not regions:
        return (whole_room(mesh),)
    return tuple(
        Room(f"region_{number}", LABELS.get(region.code, "room"), (x0, y0, x1, y1))
        for number, region in enumerate(regions)
        for x0, y0, _, x1, y1, _ in [region.bounds]
    )


def _room(thing: ScanObject, rooms: Sequence[Room]) -> str:
    """Its region, or else the nearest."""
    if thing.region >= 0:
        return rooms[thing.region].id
    x, y, _ = thing.centre
    return nearest_room(rooms, x, y).id
