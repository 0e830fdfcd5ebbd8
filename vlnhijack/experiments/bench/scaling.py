"""How time and memory of the renderers grow with what is rendered."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
from rich.progress import Progress
from torch import from_numpy
from torch.nn.functional import interpolate
from trimesh.remesh import subdivide

from vlnhijack import seeds
from vlnhijack.experiments.bench.costs import measure
from vlnhijack.experiments.bench.subject import RUNGS, Subject
from vlnhijack.scenes.house import House
from vlnhijack.scenes.importing.reduction import face_count
from vlnhijack.scenes.surface import Surface

SPP = 4
REPETITIONS = 3
MEASURES = ("forward_backward_s", "build_s", "memory_mb")
_TURN = np.radians(1.0)


@dataclass(frozen=True)
class Ladders:
    """What is varied, one at a time: the house's faces by subdivision, until there are so many;
    texels a side of the object's texture; views, each turned by a degree; samples per pixel."""

    most_faces: int = 1_500_000
    texture_sides: tuple[int, ...] = (512, 1024, 2048, 4096)
    views: tuple[int, ...] = (1, 4, 12, 36)
    spps: tuple[int, ...] = (1, 4, 16, 64)


@dataclass(frozen=True)
class Point:
    """Medians (see `Costs`) of one rung where `axis` has a value and all else is as it was."""

    axis: str
    value: int
    rung: str
    forward_backward_s: float
    build_s: float
    memory_mb: float


@dataclass(frozen=True, eq=False)
class _Step:
    axis: str
    value: int
    subject: Subject
    spp: int = SPP


def bench_scaling(subject: Subject, ladders: Ladders, progress: Progress) -> list[Point]:
    """A point for every step of every ladder and rung, each after a warm-up."""
    rungs = RUNGS[subject.house.kind]
    task = progress.add_task("scaling", total=None)
    points = []
    for step in _steps(subject, ladders):
        for rung in rungs:
            points.append(_measured(step, rung))
            progress.advance(task)
    return points


def exponents(points: Sequence[Point]) -> list[dict[str, str | float]]:
    """Least-squares slopes of log measure against log value, for every axis and rung."""
    groups: dict[tuple[str, str], list[Point]] = {}
    for point in points:
        groups.setdefault((point.axis, point.rung), []).append(point)
    return [
        {"axis": axis, "rung": rung}
        | {name: _slope([(p.value, getattr(p, name)) for p in group]) for name in MEASURES}
        for (axis, rung), group in groups.items()
    ]


def _steps(subject: Subject, ladders: Ladders) -> Iterator[_Step]:
    house = subject.house
    yield _Step("faces", face_count(house), subject)
    while face_count(house) < ladders.most_faces:
        house = replace(house, surfaces=tuple(map(_subdivided, house.surfaces)))
        yield _Step("faces", face_count(house), replace(subject, house=house))
    for side in ladders.texture_sides:
        yield _Step("texels", side**2, replace(subject, house=_retextured(subject, side)))
    (camera,) = subject.cameras
    for count in ladders.views:
        turns = (np.arange(count) - (count - 1) / 2) * _TURN
        cameras = [replace(camera, heading=camera.heading + float(turn)) for turn in turns]
        yield _Step("views", count, replace(subject, cameras=cameras))
    for spp in ladders.spps:
        yield _Step("samples", spp, subject, spp)


def _measured(step: _Step, rung: str) -> Point:
    runs = [
        asdict(measure(step.subject, rung, step.spp, seeds.integer(0, "scaling", repetition))[0])
        for repetition in range(1 + REPETITIONS)
    ]
    figures = {name: float(np.median([run[name] for run in runs[1:]])) for name in MEASURES}
    return Point(step.axis, step.value, rung, **figures)


def _slope(points: Sequence[tuple[float, float]]) -> float:
    x, y = np.log(np.maximum(points, 1e-9)).T
    return float(np.polyfit(x, y, 1)[0])


def _subdivided(surface: Surface) -> Surface:
    """Every face cut into four at the middles of its edges."""
    vertices, faces, attributes = subdivide(
        surface.vertices, surface.faces, vertex_attributes={"uv": surface.uv}
    )
    return replace(
        surface,
        vertices=vertices.astype(np.float32),
        faces=faces.astype(np.int32),
        uv=attributes["uv"].astype(np.float32),
    )


def _retextured(subject: Subject, side: int) -> House:
    """The house with the object's texture resized to side² texels."""
    item = subject.house.surface(subject.object_id)
    pixels = from_numpy(item.texture).permute(2, 0, 1)[None]
    texture = interpolate(pixels, (side, side), mode="bilinear")[0].permute(1, 2, 0).numpy()
    changed = replace(item, texture=np.ascontiguousarray(texture))
    surfaces = (changed if s is item else s for s in subject.house.surfaces)
    return replace(subject.house, surfaces=tuple(surfaces))
