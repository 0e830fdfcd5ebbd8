"""Which object each face of a scan's segmented mesh belongs to.

`<scan>.ply`            per face: material_id (its segment), segment_id (its object, an index of the
                        `.house` file), category_id; -1 for none
`<scan>.fsegs.json`     {"segIndices": segment of each face}
`<scan>.semseg.json`    {"segGroups": [{"label", "segments": segments of an object}]}
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from vlnhijack.artifacts import read_json, validated
from vlnhijack.errors import InputError
from vlnhijack.scenes.importing.memory import BYTES_PER_BYTE, require_memory
from vlnhijack.scenes.ply import columns, read_elements, triangles

LEAST_AGREEMENT = 0.9
_Id = Annotated[int, Field(ge=-1, lt=1 << 31)]


class _Segments(BaseModel):
    model_config = ConfigDict(strict=True)
    segIndices: list[_Id]


class _Group(BaseModel):
    model_config = ConfigDict(strict=True)
    segments: list[_Id]


class _Groups(BaseModel):
    segGroups: list[_Group]


_SEGMENTS, _GROUPS = TypeAdapter(_Segments), TypeAdapter(_Groups)


@dataclass(frozen=True, eq=False)
class Segmentation:
    """corners (F,3,3) float64 metres of the faces; face_object (F,) int32, -1 for none.

    agreement: of the faces that have an object or a group of `semseg.json`, the share whose object
    is that of most faces of their group.
    """

    corners: NDArray[np.float64]
    face_object: NDArray[np.int32]
    agreement: float


def read_segmentation(folder: Path, scan: str, objects: int) -> Segmentation:
    """Read the three files of a scan whose `.house` file lists so many objects.

    Raises InputError where a file is missing, broken or larger than the memory, the numbers of
    faces or the ids of objects do not match, a segment is in two groups, or less than 90 % of the
    faces agree.
    """
    mesh = folder / f"{scan}.ply"
    if mesh.is_file():
        require_memory(mesh, BYTES_PER_BYTE * mesh.stat().st_size)
    elements = read_elements(mesh)
    faces = triangles(mesh, elements)
    face_object = columns(mesh, elements, "face", ["segment_id"], np.int32)[:, 0]
    if len(faces) == 0:
        raise InputError(file=mesh, field="faces", expected="≥ 1 face", received=0)
    if face_object.min() < -1 or face_object.max() >= objects:
        raise InputError(
            file=mesh,
            field="segment_id",
            expected=f"objects in [-1, {objects}), which {scan}.house lists",
            received=f"[{face_object.min()}, {face_object.max()}]",
        )
    vertices = columns(mesh, elements, "vertex", "xyz", np.float64)
    if not np.isfinite(vertices).all():
        raise InputError(file=mesh, field="vertices", expected="finite", received="NaN or infinity")
    segments = _face_segments(folder / f"{scan}.fsegs.json", len(faces))
    groups = folder / f"{scan}.semseg.json"
    agreement = _agreement(_face_groups(groups, segments), face_object)
    if agreement < LEAST_AGREEMENT:
        raise InputError(
            file=groups,
            field="segGroups",
            expected=f"the objects of {mesh.name} on ≥ {LEAST_AGREEMENT:.0%} of the faces",
            received=f"{agreement:.1%}",
        )
    return Segmentation(vertices[faces], face_object, agreement)


def _face_segments(file: Path, faces: int) -> NDArray[np.int64]:
    segments = validated(_SEGMENTS, read_json(file), file).segIndices
    if len(segments) != faces:
        raise InputError(
            file=file, field="segIndices", expected=f"{faces} segments", received=len(segments)
        )
    return np.array(segments, np.int64)


def _face_groups(file: Path, face_segment: NDArray[np.int64]) -> NDArray[np.int64]:
    """The group (F,) of each face, -1 for none."""
    groups = validated(_GROUPS, read_json(file), file).segGroups
    owner: dict[int, int] = {}
    for number, group in enumerate(groups):
        for segment in group.segments:
            if owner.setdefault(segment, number) != number:
                raise InputError(
                    file=file,
                    field=f"segGroups.{number}.segments",
                    expected="segments of no other group",
                    received=segment,
                )
    names, index = np.unique(face_segment, return_inverse=True)
    return np.array([owner.get(name, -1) for name in names.tolist()], np.int64)[index]


def _agreement(face_group: NDArray[np.int64], face_object: NDArray[np.int32]) -> float:
    pairs, counts = np.unique(np.stack([face_group, face_object]), axis=1, return_counts=True)
    both = (pairs >= 0).all(0)
    most = np.zeros(int(face_group.max()) + 1, np.int64)
    np.maximum.at(most, pairs[0, both], counts[both])
    labelled = counts[(pairs >= 0).any(0)].sum()
    return float(most.sum() / labelled) if labelled else 1.0
