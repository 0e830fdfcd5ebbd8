"""What the frozen operator costs against `prb` at the same samples, on a full view of a room."""

import time
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
import torch

from tests.large_room import large_room
from vlnhijack.frames import Camera
from vlnhijack.rendering.coverage import object_coverage
from vlnhijack.rendering.frozen_renderer import FrozenRenderer
from vlnhijack.rendering.mitsuba_renderer import MitsubaRenderer
from vlnhijack.rendering.renderer import Renderer

CAMERA = Camera((0.0, 0.0, 1.5), 0.7, -0.2, 640, 480)
SPP = 16
pytestmark = pytest.mark.slow


def _seconds(work: Callable[[], Any], times: int = 9) -> float:
    """Median, after one call that is not timed."""
    work()
    found = []
    for _ in range(times):
        start = time.perf_counter()
        work()
        found.append(time.perf_counter() - start)
    return float(np.median(found))


def _gradient(renderer: Renderer) -> Callable[[], Any]:
    texture = torch.full(renderer.texture_shape, 0.5, requires_grad=True)
    return lambda: torch.autograd.grad(renderer(texture).sum(), texture)


@cache
def _frozen() -> FrozenRenderer:
    return FrozenRenderer(large_room(), "room_0", [CAMERA], SPP)


@cache
def _prb_seconds() -> float:
    renderer = MitsubaRenderer(large_room(), "room_0", [CAMERA], SPP, max_depth=1)
    return _seconds(_gradient(renderer))


def test_the_room_fills_the_view() -> None:
    assert object_coverage(large_room(), [CAMERA]).item() == 1


def test_an_image_with_gradient_is_fifty_times_faster() -> None:
    assert _seconds(_gradient(_frozen())) <= _prb_seconds() / 50


def test_building_takes_no_longer_than_three_images_with_gradient() -> None:
    house = large_room()
    build = _seconds(lambda: FrozenRenderer(house, "room_0", [CAMERA], SPP), 3)
    assert build <= 3 * _prb_seconds()


def test_a_full_view_takes_at_most_forty_megabytes() -> None:
    matrices = (_frozen().transport.forward, _frozen().transport.adjoint)
    arrays = [_frozen().background]
    for matrix in matrices:
        arrays += [matrix.crow_indices(), matrix.col_indices(), matrix.values()]
    assert sum(x.numel() * x.element_size() for x in arrays) <= 40e6
