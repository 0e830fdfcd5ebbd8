"""A house: surfaces, objects, rooms, lights and a navigation graph."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import hypot
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from vlnhijack.errors import InputError
from vlnhijack.navigation.graph import NavigationGraph
from vlnhijack.scenes.surface import Surface


@dataclass(frozen=True)
class HouseObject:
    """A piece of furniture: the surfaces whose `object_id` is this id.

    unwrapped: it has a single surface, with a texture of its own, and so can be attacked.
    """

    id: str
    category: str
    room: str
    centre: tuple[float, float, float]
    size: tuple[float, float, float]
    unwrapped: bool = True


@dataclass(frozen=True)
class Room:
    """A rectangular room: label such as "kitchen", and (x0, y0, x1, y1) in metres."""

    id: str
    label: str
    bounds: tuple[float, float, float, float]


def nearest_room(rooms: Sequence[Room], x: float, y: float) -> Room:
    """The room whose rectangle is nearest to a point; the first of several."""

    def distance(room: Room) -> float:
        x0, y0, x1, y1 = room.bounds
        return hypot(max(x0 - x, 0, x - x1), max(y0 - y, 0, y - y1))

    return min(rooms, key=distance)


@dataclass(frozen=True)
class Light:
    """A one-sided rectangular emitter of a lit house.

    centre (metres), the two half-edge vectors whose cross product is the emitting direction, and
    linear RGB radiance.
    """

    centre: tuple[float, float, float]
    half_u: tuple[float, float, float]
    half_v: tuple[float, float, float]
    radiance: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class House:
    """A house as it lies on disk.

    kind "baked": textures are display values, shown as they are; kind "lit": textures are
    sRGB-encoded albedo, lit by `lights`, displayed as encode(clip(exposure · radiance)).
    """

    name: str
    kind: Literal["baked", "lit"]
    surfaces: tuple[Surface, ...]
    objects: tuple[HouseObject, ...]
    rooms: tuple[Room, ...]
    graph: NavigationGraph
    lights: tuple[Light, ...] = ()
    exposure: float = 1.0

    @cached_property
    def _by_id(self) -> dict[str, tuple[HouseObject, tuple[Surface, ...]]]:
        surfaces: dict[str, tuple[Surface, ...]] = {}
        for surface in self.surfaces:
            if surface.object_id is not None:
                surfaces[surface.object_id] = (*surfaces.get(surface.object_id, ()), surface)
        return {o.id: (o, surfaces[o.id]) for o in self.objects}

    def object(self, object_id: str) -> HouseObject:
        """The object of that id; InputError where the house has none."""
        return self._lookup(object_id)[0]

    def parts(self, object_id: str) -> tuple[Surface, ...]:
        """All surfaces of an object; InputError where the house has no such object."""
        return self._lookup(object_id)[1]

    def surface(self, object_id: str) -> Surface:
        """The surface of an object; InputError where there is none, or it is not unwrapped."""
        thing, parts = self._lookup(object_id)
        if not thing.unwrapped:
            raise InputError(
                file=self.name,
                field=f"object {object_id}",
                expected="an unwrapped one (vlnhijack house unwrap)",
                received="one that shares its textures",
            )
        return parts[0]

    def with_texture(self, object_id: str, texture: NDArray[np.float32]) -> "House":
        """The house with another texture (H,W,3) on one object."""
        changed = self.surface(object_id).with_texture(texture)
        surfaces = tuple(changed if s.object_id == object_id else s for s in self.surfaces)
        return replace(self, surfaces=surfaces)

    def _lookup(self, object_id: str) -> tuple[HouseObject, tuple[Surface, ...]]:
        if object_id not in self._by_id:
            raise InputError(
                file=self.name,
                field="object",
                expected=f"one of {', '.join(sorted(self._by_id))}",
                received=object_id,
            )
        return self._by_id[object_id]
