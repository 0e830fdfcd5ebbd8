"""Seconds and memory of a renderer, and the machine that they are of."""

import os
import platform
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from vlnhijack.experiments.bench.subject import Subject
from vlnhijack.rendering.memory import peak, restart_peak
from vlnhijack.rendering.mitsuba_scene import shared_scene
from vlnhijack.rendering.variant import activate


@dataclass(frozen=True)
class Costs:
    """Seconds of an image, of an image with its gradient, and of building renderer and scene.

    memory_mb is the peak of an image with its gradient above the process before the renderer was
    built (10⁶ bytes).
    """

    forward_s: float
    forward_backward_s: float
    build_s: float
    memory_mb: float


def measure(subject: Subject, rung: str, spp: int, seed: int) -> tuple[Costs, Tensor, Tensor]:
    """Costs, images and gradient; the first call of the new renderer is not timed."""
    before = clear()
    renderer, build = _seconds(lambda: subject.renderer(rung, spp, seed))
    restart_peak()
    (image, gradient), _ = _seconds(lambda: subject.gradient(renderer))
    memory = max(peak() - before, 0.0)
    with torch.no_grad():
        _, forward = _seconds(lambda: renderer(subject.texture()))
    _, both = _seconds(lambda: subject.gradient(renderer))
    return Costs(forward, both, build, memory), image, gradient


def clear() -> float:
    """Drop unused scenes, since Mitsuba's kernels hold the surfaces of all; resident megabytes."""
    shared_scene.cache_clear()
    return restart_peak()


def machine() -> dict[str, str | int]:
    """What the figures of a benchmark depend on, besides its settings."""
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    models = {line.partition(": ")[2] for line in lines if line.startswith("model name")}
    packages = {name: version(name) for name in ("mitsuba", "drjit", "torch")}
    return {
        "cpu": ", ".join(sorted(models)) or platform.processor(),
        "cores": len(os.sched_getaffinity(0)),
        "torch_threads": torch.get_num_threads(),
        "python": platform.python_version(),
        "variant": activate().variant(),
        **packages,
    }


def _seconds(work: Callable[[], Any]) -> tuple[Any, float]:
    start = time.perf_counter()
    result = work()
    return result, time.perf_counter() - start
