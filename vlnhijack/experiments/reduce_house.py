"""Reduce a house to a budget, and measure what that costs and gains."""

import re
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rich.progress import Progress

from vlnhijack.artifacts import read_json, require_replaceable
from vlnhijack.errors import InputError
from vlnhijack.frames import Camera
from vlnhijack.navigation.views import panorama_cameras
from vlnhijack.rendering.observe import render_views
from vlnhijack.scenes.house import House
from vlnhijack.scenes.house_files import HOUSE_FILE, load_house, save_house
from vlnhijack.scenes.importing.reduction import face_count, reduce_faces, reduce_texels

VIEWPOINTS, WIDTH, HEIGHT, SPP = 8, 160, 120, 16
FEWEST_FACES, FEWEST_TEXELS = 500, 32
_PROGRESS = 0.98  # a step that keeps more than this of the faces ends the search


@dataclass(frozen=True)
class Budget:
    """Faces of the house and texels along an edge of each texture; None for what is there."""

    faces: int | None = None
    texels: int | None = None


class Measured(NamedTuple):
    """A house in numbers: megabytes (10⁶) of its arrays; seconds of the views that are compared;
    RMSE of their display values against the original's."""

    faces: int
    texels: int
    megabytes: float
    seconds: float
    rmse: float


def parse_budget(text: str) -> Budget | None:
    """The budget of "FACES" or "FACESxTEXELS", None of "auto"; InputError for anything else."""
    if text == "auto":
        return None
    match = re.fullmatch(r"([1-9][0-9]*)(?:x([1-9][0-9]*))?", text)
    if match is None:
        expected = "auto, FACES or FACESxTEXELS, such as 50000x512"
        raise InputError(field="budget", expected=expected, received=text)
    return Budget(int(match[1]), int(match[2]) if match[2] else None)


def reduce_folder(
    folder: Path, out: Path, budget: Budget | None, max_error: float, progress: Progress
) -> tuple[list[Measured], Measured]:
    """Write the reduced house to `out`; the original and every reduction that was tried, and the
    one that was kept.

    Without a budget, the smallest that keeps the RMSE of the compared views at or below max_error:
    first of faces, then of texels, each halved as long as that holds. Raises InputError where
    max_error is not positive.
    """
    if not max_error > 0:
        raise InputError(field="max-error", expected="a positive RMSE", received=max_error)
    require_replaceable(out, HOUSE_FILE)
    house = load_house(folder)
    task = progress.add_task(f"{house.name}: the original", total=None)
    views = _Views(house)
    rows = [views.measure(house)]
    kept = rows[0]
    if budget is not None:
        reduced = _reduced(house, budget)
        kept = views.measure(reduced)
        rows.append(kept)
    else:
        reduced = house
        for step in _halved_faces, _halved_texels:
            for smaller in step(reduced):
                measured = views.measure(smaller)
                rows.append(measured)
                progress.update(task, description=f"{house.name}: RMSE {measured.rmse:.4f}")
                if measured.rmse > max_error:
                    break
                reduced, kept = smaller, measured
    save_house(reduced, out, None if out.resolve() == folder.resolve() else _episodes(folder))
    return rows, kept


def _episodes(folder: Path) -> dict[str, list[dict[str, Any]]]:
    """The records of each split of a house."""
    return {file.stem: read_json(file) for file in sorted((folder / "episodes").glob("*.json"))}


class _Views:
    """Views of the original to compare with: all at eye level, of viewpoints spread evenly."""

    def __init__(self, house: House) -> None:
        positions = house.graph.positions
        rows = np.linspace(0, len(positions) - 1, min(VIEWPOINTS, len(positions))).astype(int)
        self._cameras: list[Camera] = []
        for x, y, z in positions[rows].tolist():
            self._cameras += panorama_cameras((x, y, z), WIDTH, HEIGHT)[12:24]
        self._original = render_views(house, self._cameras, SPP)

    def measure(self, house: House) -> Measured:
        render_views(house, self._cameras[:1], SPP)
        started = time.perf_counter()
        images = render_views(house, self._cameras, SPP)
        seconds = time.perf_counter() - started
        rmse = float((images - self._original).square().mean().sqrt())
        textures = {id(s.texture): s.texture for s in house.surfaces}
        arrays = [a for s in house.surfaces for a in (s.vertices, s.faces, s.uv)]
        megabytes = sum(array.nbytes for array in [*arrays, *textures.values()]) / 1e6
        texels = sum(t.shape[0] * t.shape[1] for t in textures.values())
        return Measured(face_count(house), texels, megabytes, seconds, rmse)


def _reduced(house: House, budget: Budget) -> House:
    fewer = house if budget.faces is None else reduce_faces(house, budget.faces)
    return fewer if budget.texels is None else reduce_texels(fewer, budget.texels)


def _halved_faces(house: House) -> Iterator[House]:
    """The house with half, a quarter, … of its faces, as long as they get fewer."""
    count, target = face_count(house), face_count(house) // 2
    while target >= FEWEST_FACES:
        smaller = reduce_faces(house, target)
        if face_count(smaller) > _PROGRESS * count:
            return
        yield smaller
        count, target = face_count(smaller), target // 2


def _halved_texels(house: House) -> Iterator[House]:
    """The house with half, a quarter, … of the texels along the edges of its largest textures."""
    edge = max(max(surface.texture.shape[:2]) for surface in house.surfaces) // 2
    while edge >= FEWEST_TEXELS:
        yield reduce_texels(house, edge)
        edge //= 2
