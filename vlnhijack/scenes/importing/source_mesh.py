"""A textured mesh as its file holds it, before it becomes a house."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vlnhijack.errors import InputError
from vlnhijack.scenes.house import Room
from vlnhijack.scenes.surface import Wrap

BACKGROUND = -1
SMALLEST, LARGEST = 0.5, 500.0


@dataclass(frozen=True, eq=False)
class Material:
    """A look: image (H,W,3) uint8 or, where there is none, colour (r, g, b); display values.

    wrap says what lies beyond the image's borders.
    """

    name: str
    image: NDArray[np.uint8] | None = None
    colour: tuple[float, float, float] = (1.0, 1.0, 1.0)
    wrap: Wrap = "repeat"


@dataclass(frozen=True)
class SourceObject:
    """A thing that may be attacked; id and room become those of the house."""

    id: str
    category: str
    room: str


@dataclass(frozen=True, eq=False)
class SourceMesh:
    """N vertices and F triangles with materials and objects.

    file names the mesh in errors; vertices (N,3) float64 metres, z up; faces (F,3) int32,
    counter-clockwise seen from the front; corner_uv (F,3,2) float32 with (0,0) at the corner of
    the image's first row and column, u to the right, v down; vertex_colours (N,3) uint8 display
    values that multiply the material, or None; face_material (F,) int32 into `materials`;
    face_object (F,) int32 into `objects`, -1 for background.

    Raises InputError where a part has another shape, an index is out of range, a value is not
    finite, there is no face, or the extent is not that of a house (0.5 to 500 m).
    """

    file: str
    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    corner_uv: NDArray[np.float32]
    vertex_colours: NDArray[np.uint8] | None
    face_material: NDArray[np.int32]
    materials: tuple[Material, ...]
    face_object: NDArray[np.int32]
    objects: tuple[SourceObject, ...] = ()

    def __post_init__(self) -> None:
        n, f = len(self.vertices), len(self.faces)
        if f == 0:
            raise InputError(file=self.file, field="faces", expected="≥ 1 face", received=0)
        self._check_part("vertices", np.float64, (n, 3))
        self._check_part("faces", np.int32, (f, 3))
        self._check_part("corner_uv", np.float32, (f, 3, 2))
        self._check_part("face_material", np.int32, (f,))
        self._check_part("face_object", np.int32, (f,))
        if self.vertex_colours is not None:
            self._check_part("vertex_colours", np.uint8, (n, 3))
        self._check_range("faces", 0, n)
        self._check_range("face_material", 0, len(self.materials))
        self._check_range("face_object", BACKGROUND, len(self.objects))
        self._check_materials()
        self._check_objects()
        self._check_extent()

    def _check_part(self, field: str, dtype: type, shape: tuple[int, ...]) -> None:
        array = getattr(self, field)
        if array.dtype != dtype or array.shape != shape:
            raise InputError(
                file=self.file,
                field=field,
                expected=f"{np.dtype(dtype)} {shape}",
                received=f"{array.dtype} {array.shape}",
            )
        if not np.isfinite(array).all():
            raise InputError(
                file=self.file, field=field, expected="finite numbers", received="NaN or infinity"
            )

    def _check_range(self, field: str, low: int, end: int) -> None:
        array = getattr(self, field)
        if array.min() < low or array.max() >= end:
            raise InputError(
                file=self.file,
                field=field,
                expected=f"indices in [{low}, {end})",
                received=f"[{array.min()}, {array.max()}]",
            )

    def _check_materials(self) -> None:
        for material in self.materials:
            image = material.image
            if image is not None and (
                image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] != 3 or not image.size
            ):
                raise InputError(
                    file=self.file,
                    field=f"image of material {material.name}",
                    expected="uint8 (H, W, 3)",
                    received=f"{image.dtype} {image.shape}",
                )

    def _check_objects(self) -> None:
        ids = [thing.id for thing in self.objects]
        repeated = sorted({name for name in ids if ids.count(name) > 1})
        empty = sorted(set(ids) - {ids[i] for i in np.unique(self.face_object) if i >= 0})
        for wrong, expected in ((repeated, "distinct ids"), (empty, "faces for every object")):
            if wrong:
                raise InputError(file=self.file, field="objects", expected=expected, received=wrong)

    def _check_extent(self) -> None:
        used = self.vertices[np.unique(self.faces)]
        extent = float((used.max(0) - used.min(0)).max())
        if not SMALLEST <= extent <= LARGEST:
            raise InputError(
                file=self.file,
                field="extent",
                expected=f"a house of {SMALLEST} to {LARGEST:.0f} m; "
                "give --scale 0.001 if it is in millimetres, 0.01 if in centimetres",
                received=f"{extent:.4g} m",
            )


def whole_room(mesh: SourceMesh) -> Room:
    """One room as large as the mesh."""
    used = mesh.vertices[mesh.faces.ravel()]
    (x0, y0, _), (x1, y1, _) = used.min(0).tolist(), used.max(0).tolist()
    return Room("room_0", "room", (x0, y0, x1, y1))
