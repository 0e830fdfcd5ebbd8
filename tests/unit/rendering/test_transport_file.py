"""Operators on disk: read back bit by bit, refused when anything they depend on has changed."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from tests.houses import tiny_house
from vlnhijack.errors import InputError
from vlnhijack.frames import Camera
from vlnhijack.rendering import frozen_renderer
from vlnhijack.rendering.filters import Filters
from vlnhijack.rendering.frozen_renderer import FrozenRenderer
from vlnhijack.rendering.transport_file import fingerprint

OBJECT = "cabinet_0"
CAMERA = Camera((-1.2, -1.2, 1.5), 0.8, -0.4, 16, 12)


def test_a_file_gives_the_same_bits_without_tracing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "operators" / "a.safetensors"
    built = FrozenRenderer(tiny_house(), OBJECT, [CAMERA], 4, 1, file=file)
    monkeypatch.setattr(frozen_renderer, "build", None)
    read = FrozenRenderer(tiny_house(), OBJECT, [CAMERA], 4, 1, file=file)
    texture = torch.rand(built.texture_shape, requires_grad=True)
    images = [renderer(texture) for renderer in (built, read)]
    assert torch.equal(*images)
    gradients = [torch.autograd.grad(image.square().sum(), texture)[0] for image in images]
    assert torch.equal(*gradients)


def test_a_stale_file_is_refused_in_one_line(tmp_path: Path) -> None:
    file = tmp_path / "a.safetensors"
    FrozenRenderer(tiny_house(), OBJECT, [CAMERA], 4, 1, file=file)
    with pytest.raises(InputError, match="stale operator, delete the file") as caught:
        FrozenRenderer(tiny_house(), OBJECT, [CAMERA], 4, 2, file=file)
    assert str(caught.value).startswith(f"{file}: key: ")
    file.write_bytes(b"nonsense")
    with pytest.raises(InputError, match="not a safetensors file"):
        FrozenRenderer(tiny_house(), OBJECT, [CAMERA], 4, 1, file=file)


def test_the_key_follows_everything_but_the_objects_texels() -> None:
    house = tiny_house()
    white = np.ones((64, 64, 3), np.float32)
    wrapped = replace(house.surfaces[0], wrap="repeat")
    moved = replace(house.surfaces[0], vertices=house.surfaces[0].vertices + np.float32(1e-3))
    changes = [
        (house, OBJECT, [CAMERA], 4, 0, Filters()),
        (house, "table_0", [CAMERA], 4, 0, Filters()),
        (house, OBJECT, [replace(CAMERA, heading=0.81)], 4, 0, Filters()),
        (house, OBJECT, [CAMERA], 16, 0, Filters()),
        (house, OBJECT, [CAMERA], 4, 1, Filters()),
        (house, OBJECT, [CAMERA], 4, 0, Filters("gaussian")),
        (house.with_texture("table_0", white), OBJECT, [CAMERA], 4, 0, Filters()),
        (replace(house, surfaces=(moved, *house.surfaces[1:])), OBJECT, [CAMERA], 4, 0, Filters()),
        (
            replace(house, surfaces=(wrapped, *house.surfaces[1:])),
            OBJECT,
            [CAMERA],
            4,
            0,
            Filters(),
        ),
    ]
    keys = {fingerprint(*change) for change in changes}
    assert len(keys) == len(changes)
    painted = house.with_texture(OBJECT, white)
    assert fingerprint(painted, OBJECT, [CAMERA], 4, 0, Filters()) in keys
