"""Houses of source meshes look like the meshes, before and after objects are unwrapped."""

from dataclasses import replace

import numpy as np
import pytest

from tests.source_room import ROOM, direct_render, furnished_room, line_graph, psnr
from vlnhijack.errors import InputError
from vlnhijack.frames import Camera
from vlnhijack.rendering.observe import render_views
from vlnhijack.scenes.house import House
from vlnhijack.scenes.house_files import load_house, save_house
from vlnhijack.scenes.importing.assemble import assemble
from vlnhijack.scenes.importing.unwrapping import unwrapped
from vlnhijack.scenes.uv_atlas import has_overlap

CAMERAS = [
    Camera((0.5, 2.3, 1.5), np.deg2rad(120), -0.3, 96, 72),
    Camera((3.3, 0.8, 1.5), np.deg2rad(-60), -0.5, 96, 72),
]
SPP = 64


def house_of(source) -> House:
    return assemble(source, "made", line_graph("made"), [ROOM])


def difference(source, house: House) -> float:
    return psnr(render_views(house, CAMERAS, SPP).numpy(), direct_render(source, CAMERAS, 6))


@pytest.mark.parametrize("colours", [False, True])
def test_house_looks_like_the_mesh(colours: bool) -> None:
    source = furnished_room(colours)
    assert difference(source, house_of(source)) > 38


@pytest.mark.parametrize("colours", [False, True])
def test_unwrapped_objects_look_the_same(colours: bool) -> None:
    source = furnished_room(colours)
    house = unwrapped(house_of(source), ["table_0", "ball"])
    table = house.surface("table_0")
    assert not has_overlap(table.uv, table.faces, len(table.texture))
    assert difference(source, house) > 38
    assert len(house.parts("table_0")) == 1


def test_objects_share_textures_until_they_are_unwrapped() -> None:
    house = house_of(furnished_room())
    red = [s for s in house.surfaces if s.name.endswith("-003")]
    assert len(red) == 2
    assert red[0].texture is red[1].texture
    with pytest.raises(InputError, match="house unwrap"):
        house.surface("table_0")
    assert unwrapped(house, ["ball"]).surface("ball").wrap == "clamp"


def test_unwrapped_objects_share_no_texture(tmp_path) -> None:
    house = unwrapped(house_of(furnished_room()), ["ball"])
    *others, ball = house.surfaces
    for wrong in (replace(ball, wrap="repeat"), replace(ball, texture=others[0].texture)):
        with pytest.raises(InputError, match="textures.*ball"):
            save_house(replace(house, surfaces=(*others, wrong)), tmp_path / "made")


def test_shared_textures_are_one_file(tmp_path) -> None:
    house = house_of(furnished_room())
    save_house(house, tmp_path / "made")
    loaded = load_house(tmp_path / "made")
    assert len(list((tmp_path / "made" / "textures").iterdir())) == 4
    assert [s.wrap for s in loaded.surfaces] == [s.wrap for s in house.surfaces]
    assert [o.unwrapped for o in loaded.objects] == [False, False]
    by_name = {s.name: s.texture for s in loaded.surfaces}
    assert by_name["ball-003"] is by_name["table_0-003"]
    images = render_views(house, CAMERAS, 4), render_views(loaded, CAMERAS, 4)
    assert (images[0] - images[1]).abs().max() < 0.003
