"""What each renderer costs on one view of a baked house, and how wrong it is (design, 5)."""

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from itertools import product
from typing import Any

import numpy as np
import torch
from rich.progress import Progress
from torch import Tensor

from vlnhijack import seeds
from vlnhijack.errors import InputError
from vlnhijack.frames import Camera
from vlnhijack.navigation.views import VIEWS, View, panorama_cameras, view_angles
from vlnhijack.rendering.coverage import object_coverage
from vlnhijack.rendering.frozen_renderer import FrozenRenderer
from vlnhijack.rendering.memory import peak, restart_peak
from vlnhijack.rendering.mitsuba_renderer import MitsubaRenderer
from vlnhijack.rendering.mitsuba_scene import shared_scene
from vlnhijack.rendering.observe import render_views
from vlnhijack.rendering.renderer import Renderer
from vlnhijack.scenes.house import House

SPPS = (4, 16)
REPETITIONS = 5
REFERENCE_SPP = 64
REFERENCE_BATCHES = 16
_RUNGS: dict[str, Callable[..., Renderer]] = {"frozen": FrozenRenderer, "prb": MitsubaRenderer}


@dataclass(frozen=True)
class Row:
    """Medians of one rung at one number of samples per pixel.

    Seconds of an image, of an image with its gradient, and of building the renderer with its scene;
    memory_mb is the peak of an image with its gradient above the process before the renderer was
    built (10⁶ bytes).

    Against the reference: RMSE and PSNR (dB) of the image in display values; cosine and norm ratio
    of the gradient of a fixed random linear functional of the image.
    """

    rung: str
    spp: int
    forward_s: float
    forward_backward_s: float
    build_s: float
    memory_mb: float
    rmse: float
    psnr: float
    grad_cosine: float
    grad_norm_ratio: float


@dataclass(frozen=True, eq=False)
class _Subject:
    """The view that is rendered; weights (1,3,h,w) of the functional."""

    house: House
    object_id: str
    camera: Camera
    weights: Tensor

    def renderer(self, rung: str, spp: int, seed: int) -> Any:
        return _RUNGS[rung](self.house, self.object_id, [self.camera], spp, seed)

    def texture(self) -> Tensor:
        return torch.from_numpy(self.house.surface(self.object_id).texture)

    def gradient(self, renderer: Renderer) -> tuple[Tensor, Tensor]:
        """Image (1,3,h,w), and the gradient (H,W,3) of the functional."""
        texture = self.texture().requires_grad_()
        image = renderer(texture)
        (gradient,) = torch.autograd.grad(image, texture, self.weights)
        return image.detach(), gradient


def fullest_view(
    house: House, object_id: str | None = None, viewpoint: str | None = None
) -> tuple[str, View]:
    """The object, and the view, where an object fills the largest share of a view.

    object_id and viewpoint narrow the choice. Raises InputError where the house lacks them, or
    where no view is left that shows an object.
    """
    objects = [object_id] if object_id else [item.id for item in house.objects]
    names = [viewpoint] if viewpoint else list(house.graph.viewpoints)
    for name in objects:
        house.object(name)
    positions = house.graph.positions[[house.graph.row(name) for name in names]].tolist()
    cameras = [camera for x, y, z in positions for camera in panorama_cameras((x, y, z), 64, 48)]
    columns = [index for index, item in enumerate(house.objects) if item.id in objects]
    share = object_coverage(house, cameras, spp=1)[:, columns]
    if not share.any():
        raise InputError(
            file=house.name,
            field="object",
            expected="one that a view shows",
            received=f"{object_id or 'any'} at {viewpoint or 'any viewpoint'}",
        )
    row, column = np.unravel_index(int(share.argmax()), share.shape)
    return objects[column], View(names[row // VIEWS], int(row % VIEWS))


def bench_render(
    house: House,
    object_id: str,
    viewpoint: str,
    view: int,
    size: tuple[int, int],
    spps: Sequence[int],
    progress: Progress,
) -> list[Row]:
    """One row per rung and number of samples, measured in turn after a warm-up.

    size is width and height in pixels. Every repetition draws other camera rays, equal for all
    rungs; the reference averages REFERENCE_BATCHES times REFERENCE_SPP others. Raises InputError
    where the house is lit, lacks the object or viewpoint, or where a number of samples is no
    square.
    """
    width, height = size
    x, y, z = house.graph.positions[house.graph.row(viewpoint)].tolist()
    camera = Camera((x, y, z), *view_angles(view), width, height)
    weights = seeds.stream(0, "bench functional").standard_normal((1, 3, height, width))
    subject = _Subject(house, object_id, camera, torch.from_numpy(weights).float())
    cases = list(product(_RUNGS, spps))
    task = progress.add_task(
        "renderers", total=len(cases) * (1 + REPETITIONS) + 2 * REFERENCE_BATCHES
    )
    for rung, spp in cases:
        _time(subject, rung, spp, seeds.integer(0, "bench warm-up"))
        progress.advance(task)
    reference = _reference(subject, lambda: progress.advance(task))
    found: dict[tuple[str, int], list[Row]] = {case: [] for case in cases}
    for repetition, (rung, spp) in product(range(REPETITIONS), cases):
        found[rung, spp].append(
            _measure(subject, rung, spp, seeds.integer(0, "bench", repetition), reference)
        )
        progress.advance(task)
    return [_median(rows) for rows in found.values()]


def _reference(subject: _Subject, advance: Callable[[], None]) -> tuple[Tensor, Tensor]:
    """Image and gradient, means over batches of camera rays that no renderer is measured at."""
    batches = [seeds.integer(0, "bench reference", batch) for batch in range(REFERENCE_BATCHES)]
    image, gradient = torch.zeros_like(subject.weights), torch.zeros_like(subject.texture())
    _clear()
    renderer = subject.renderer("prb", REFERENCE_SPP, 0)
    for renderer.seed in batches:
        gradient += subject.gradient(renderer)[1]
        advance()
    del renderer
    _clear()
    for seed in batches:
        image += render_views(subject.house, [subject.camera], REFERENCE_SPP, seed)
        advance()
    return image / REFERENCE_BATCHES, gradient / REFERENCE_BATCHES


def _measure(
    subject: _Subject, rung: str, spp: int, seed: int, reference: tuple[Tensor, Tensor]
) -> Row:
    costs, image, gradient = _time(subject, rung, spp, seed)
    true_image, true_gradient = reference
    rmse = max(float((image - true_image).square().mean().sqrt()), 1e-7)
    return Row(
        rung,
        spp,
        **costs,
        rmse=rmse,
        psnr=-20 * float(np.log10(rmse)),
        grad_cosine=float(
            torch.cosine_similarity(gradient.ravel().double(), true_gradient.ravel().double(), 0)
        ),
        grad_norm_ratio=float(gradient.norm() / true_gradient.norm()),
    )


def _time(
    subject: _Subject, rung: str, spp: int, seed: int
) -> tuple[dict[str, float], Tensor, Tensor]:
    """Costs as named in Row, image and gradient; the first call of a new renderer is not timed."""
    before = _clear()
    renderer, build = _seconds(lambda: subject.renderer(rung, spp, seed))
    restart_peak()
    (image, gradient), _ = _seconds(lambda: subject.gradient(renderer))
    memory = max(peak() - before, 0.0)
    with torch.no_grad():
        _, forward = _seconds(lambda: renderer(subject.texture()))
    _, both = _seconds(lambda: subject.gradient(renderer))
    costs = {
        "forward_s": forward,
        "forward_backward_s": both,
        "build_s": build,
        "memory_mb": memory,
    }
    return costs, image, gradient


def _clear() -> float:
    """Drop unused scenes, since Mitsuba's kernels hold the surfaces of all; resident megabytes."""
    shared_scene.cache_clear()
    return restart_peak()


def _seconds(work: Callable[[], Any]) -> tuple[Any, float]:
    start = time.perf_counter()
    result = work()
    return result, time.perf_counter() - start


def _median(rows: Sequence[Row]) -> Row:
    first, *_ = records = [asdict(row) for row in rows]
    numbers = [name for name in first if name not in ("rung", "spp")]
    medians = {name: float(np.median([record[name] for record in records])) for name in numbers}
    return Row(first["rung"], first["spp"], **medians)
