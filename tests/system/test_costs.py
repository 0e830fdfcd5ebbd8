"""What the frozen operator of a full view of a room takes; its speed is for `bench render`."""

from functools import cache

from tests.large_room import large_room
from vlnhijack.frames import Camera
from vlnhijack.rendering.coverage import object_coverage
from vlnhijack.rendering.frozen_renderer import FrozenRenderer

CAMERA = Camera((0.0, 0.0, 1.5), 0.7, -0.2, 640, 480)


@cache
def _frozen() -> FrozenRenderer:
    return FrozenRenderer(large_room(), "room_0", [CAMERA], 16)


def test_the_room_fills_the_view() -> None:
    assert object_coverage(large_room(), [CAMERA]).item() == 1


def test_a_full_view_takes_at_most_forty_megabytes() -> None:
    transport = _frozen().transport
    arrays = [_frozen().background, transport.texels]
    for matrix in (transport.forward, transport.adjoint):
        arrays += [matrix.crow_indices(), matrix.col_indices(), matrix.values()]
    assert sum(x.numel() * x.element_size() for x in arrays) <= 40e6
