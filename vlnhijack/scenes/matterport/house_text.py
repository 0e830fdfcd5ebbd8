"""The text of a `.house` file of one of our houses (its form: see `house_file`)."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vlnhijack.scenes.categories import mpcat40_id
from vlnhijack.scenes.house import House, HouseObject, Room
from vlnhijack.scenes.matterport.house_file import VERSION
from vlnhijack.scenes.matterport.regions import CODES, UNKNOWN
from vlnhijack.scenes.surface import Surface

Box = NDArray[np.floating]


def house_text(house: House, segment_objects: Sequence[int]) -> str:
    """The text; every surface is a segment, with the index of its object or -1."""
    boxes = [np.stack([s.vertices.min(0), s.vertices.max(0)]) for s in house.surfaces]
    whole = np.stack([np.min(boxes, (0, 1)), np.max(boxes, (0, 1))])
    categories = sorted({thing.category for thing in house.objects})
    rooms = [room.id for room in house.rooms]
    lines = [
        VERSION,
        _header(house, len(categories), whole),
        f"L  0  {len(rooms)}  -  {_numbers(whole.mean(0))}  {_numbers(whole)}  0 0 0 0 0",
        *(_region(number, room, whole) for number, room in enumerate(house.rooms)),
        *_panoramas(house),
        *(_category(number, name) for number, name in enumerate(categories)),
        *(
            _object(number, thing, rooms.index(thing.room), categories.index(thing.category))
            for number, thing in enumerate(house.objects)
        ),
        *map(_segment, range(len(boxes)), segment_objects, boxes, house.surfaces),
    ]
    return "\n".join(lines) + "\n"


def _header(house: House, categories: int, box: Box) -> str:
    counts = [0, len(house.graph.viewpoints), 0, 0, len(house.surfaces), len(house.objects)]
    counts += [categories, len(house.rooms), 0, 1]
    return f"H  {house.name}  -  {_numbers(counts)}  0 0 0 0 0  {_numbers(box)}  0 0 0 0 0"


def _region(number: int, room: Room, whole: Box) -> str:
    box = np.reshape(room.bounds, (2, 2))
    low, high = (np.append(corner, z) for corner, z in zip(box, whole[:, 2], strict=True))
    where = f"{_numbers((low + high) / 2)}  {_numbers(low)}  {_numbers(high)}"
    code = CODES.get(room.label, UNKNOWN)
    return f"R  {number} 0  0 0  {code}  {where}  {high[2] - low[2]:.6g}  0 0 0 0"


def _panoramas(house: House) -> Iterator[str]:
    bounds = np.array([room.bounds for room in house.rooms]).reshape(-1, 4)
    for number, (name, position) in enumerate(
        zip(house.graph.viewpoints, house.graph.positions, strict=True)
    ):
        x, y, _ = position
        inside = (bounds[:, 0] <= x) & (x <= bounds[:, 2])
        inside &= (bounds[:, 1] <= y) & (y <= bounds[:, 3])
        region = int(inside.argmax()) if inside.any() else -1
        yield f"P  {name}  {number} {region}  0  {_numbers(position)}  0 0 0 0 0"


def _category(number: int, name: str) -> str:
    index, word = mpcat40_id(name), name.replace(" ", "#")
    return f"C  {number}  {index} {word}  {index} {word}  0 0 0 0 0"


def _object(number: int, thing: HouseObject, region: int, category: int) -> str:
    radii = np.array(thing.size) / 2
    box = f"{_numbers(thing.centre)}  1 0 0  0 1 0  {_numbers(radii)}"
    return f"O  {number} {region} {category}  {box}  0 0 0 0 0 0 0 0"


def _segment(number: int, owner: int, box: Box, surface: Surface) -> str:
    a, b, c = (surface.vertices[surface.faces[:, i]] for i in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    where = f"{_numbers(box.mean(0))}  {_numbers(box)}"
    return f"E  {number} {owner} {number}  {area:.6g}  {where}  0 0 0 0 0"


def _numbers(values: ArrayLike) -> str:
    return " ".join(f"{value:.6g}" for value in np.ravel(values))
