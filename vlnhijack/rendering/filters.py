"""How samples weigh: the film's filter over pixels, the texture's over texels."""

from dataclasses import dataclass, fields
from typing import Any, Literal, get_args

from vlnhijack.errors import InputError
from vlnhijack.rendering.variant import activate
from vlnhijack.scenes.surface import Wrap

Film = Literal["box", "gaussian"]
Lookup = Literal["bilinear", "nearest"]


@dataclass(frozen=True)
class Filters:
    """Names of Mitsuba's film filter, texture filter and texture wrap mode.

    The defaults are those of every house on disk. Raises InputError for another name.
    """

    film: Film = "box"
    lookup: Lookup = "bilinear"
    wrap: Wrap = "clamp"

    def __post_init__(self) -> None:
        for field, names in zip(fields(self), (Film, Lookup, Wrap), strict=True):
            if (received := getattr(self, field.name)) not in get_args(names):
                raise InputError(
                    field=field.name, expected=f"one of {get_args(names)}", received=received
                )

    @property
    def taps(self) -> int:
        """Texels of one lookup."""
        return 4 if self.lookup == "bilinear" else 1


def film_filter(filters: Filters) -> Any:
    """Mitsuba's reconstruction filter."""
    return activate().load_dict({"type": filters.film})


def texel_of(
    uv: Any, tap: Any, texture_shape: tuple[int, int, int], filters: Filters
) -> tuple[Any, Any]:
    """Texel, an index into (H·W), and weight of one tap (< `filters.taps`) of a lookup at uv.

    As Mitsuba's bitmap texture does: nearest is the texel at u·W, bilinear the four around u·W − ½.
    """
    mi = activate()
    import drjit as dr

    height, width, _ = texture_shape
    u, v = uv
    if filters.lookup == "nearest":
        column, row = dr.floor(u * width), dr.floor(v * height)
        weight = mi.Float(1)
    else:
        x, y = dr.fma(u, width, -0.5), dr.fma(v, height, -0.5)
        column, row = dr.floor(x), dr.floor(y)
        right, below = (tap & 1) == 1, tap >= 2
        weight = dr.select(right, x - column, 1 - x + column)
        weight *= dr.select(below, y - row, 1 - y + row)
        column, row = column + mi.Float(right), row + mi.Float(below)
    inside = [
        _wrapped(mi.Int32(index), size, filters.wrap)
        for index, size in ((row, height), (column, width))
    ]
    return inside[0] * width + inside[1], weight


def _wrapped(index: Any, size: int, wrap: Wrap) -> Any:
    """The index in [0, size) that an index outside stands for."""
    mi = activate()
    import drjit as dr

    if wrap == "clamp":
        return dr.clip(index, 0, size - 1)
    repetition = mi.Int32(dr.floor(mi.Float(index) / size))
    within = dr.clip(index - repetition * size, 0, size - 1)
    if wrap == "repeat":
        return within
    return dr.select((repetition & 1) == 0, within, size - 1 - within)
