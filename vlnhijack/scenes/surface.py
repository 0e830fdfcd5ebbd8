"""A surface: a triangle mesh with a texture and, if it is attackable, an object id."""

from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from vlnhijack.errors import InputError

Wrap = Literal["clamp", "repeat", "mirror"]


@dataclass(frozen=True, eq=False)
class Surface:
    """A mesh and its texture, which surfaces of the background may share.

    vertices (N,3) float32 metres; faces (F,3) int32, counter-clockwise seen from the front;
    uv (N,2) float32, (0,0) at the corner of the texture's first row and column, u to the right,
    v down; texture (H,W,3) float32 display values in [0,1] (baked: radiance as displayed; lit:
    sRGB-encoded albedo); object_id None for background; wrap: what lies beyond the texture's
    borders. An object whose only surface has a texture of its own, clamped, can be attacked.
    """

    name: str
    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]
    uv: NDArray[np.float32]
    texture: NDArray[np.float32]
    object_id: str | None = None
    wrap: Wrap = "clamp"

    def __post_init__(self) -> None:
        _require(self, "vertices", self.vertices, np.float32, (None, 3))
        _require(self, "faces", self.faces, np.int32, (None, 3))
        _require(self, "uv", self.uv, np.float32, (len(self.vertices), 2))
        _require(self, "texture", self.texture, np.float32, (None, None, 3))
        if self.wrap not in get_args(Wrap):
            raise InputError(
                file=self.name, field="wrap", expected=get_args(Wrap), received=self.wrap
            )
        if len(self.faces) == 0:
            raise InputError(file=self.name, field="faces", expected="≥ 1 face", received=0)
        if self.faces.min() < 0 or self.faces.max() >= len(self.vertices):
            raise InputError(
                file=self.name,
                field="faces",
                expected=f"indices in [0, {len(self.vertices)})",
                received=f"[{self.faces.min()}, {self.faces.max()}]",
            )
        for field in ("vertices", "uv", "texture"):
            if not np.isfinite(getattr(self, field)).all():
                raise InputError(
                    file=self.name, field=field, expected="finite", received="NaN or infinity"
                )

    def with_texture(self, texture: NDArray[np.float32]) -> "Surface":
        """The same mesh with another texture (H,W,3) of the same shape."""
        if texture.shape != self.texture.shape:
            raise InputError(
                file=self.name,
                field="texture",
                expected=self.texture.shape,
                received=texture.shape,
            )
        return replace(self, texture=np.ascontiguousarray(texture, np.float32))


def _require(
    surface: Surface,
    field: str,
    array: NDArray[np.generic],
    dtype: type,
    shape: tuple[int | None, ...],
) -> None:
    fits = len(array.shape) == len(shape) and all(
        want is None or want == got for want, got in zip(shape, array.shape, strict=True)
    )
    if array.dtype != dtype or not fits:
        raise InputError(
            file=surface.name,
            field=field,
            expected=f"{np.dtype(dtype)} {shape}",
            received=f"{array.dtype} {array.shape}",
        )
