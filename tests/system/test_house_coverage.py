"""The coverage kept with a house: exact counts, equal to the operator's row sums, never stale."""

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.fuzz import refused_or_read, texts
from tests.houses import tiny_house
from vlnhijack.errors import InputError
from vlnhijack.experiments import house_coverage
from vlnhijack.experiments.config import DatasetInstances
from vlnhijack.experiments.house_coverage import FILE, load_coverage, measure_coverage
from vlnhijack.experiments.instances.datasets import load_scans
from vlnhijack.navigation.episode import Episode, save_episodes
from vlnhijack.navigation.views import panorama_cameras
from vlnhijack.rendering.coverage import object_index_map
from vlnhijack.rendering.frozen_renderer import FrozenRenderer
from vlnhijack.scenes.house_files import load_house, save_house

WIDTH, HEIGHT = 64, 48


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(house_coverage, "WIDTH", WIDTH)
    monkeypatch.setattr(house_coverage, "HEIGHT", HEIGHT)
    save_house(tiny_house(), tmp_path / "tiny_baked")
    return tmp_path / "tiny_baked"


def test_counts_are_the_row_sums_of_the_operator(folder: Path) -> None:
    views: list[int] = []
    measured = measure_coverage(folder, load_house(folder), views.append)
    house = load_house(folder)
    kept = load_coverage(folder, house)
    assert kept is not None
    assert sum(views) == 36 * 4
    assert np.array_equal(kept.pixels, measured.pixels)
    assert (kept.width, kept.height) == (WIDTH, HEIGHT)
    for row, (x, y, z) in enumerate(house.graph.positions.tolist()):
        cameras = panorama_cameras((x, y, z), WIDTH, HEIGHT)
        index = object_index_map(house, cameras)
        for column, thing in enumerate(house.objects):
            frozen = FrozenRenderer(house, thing.id, cameras, spp=1)
            ones = torch.ones(frozen.transport.forward.shape[1], 1)
            rows = (frozen.transport.forward @ ones).view(36, -1).sum(1).numpy()
            np.testing.assert_allclose(rows, kept.pixels[row, :, column], atol=1e-2)
            centres = (index == column).sum((1, 2))
            assert np.abs(centres - rows).max() < 0.02 * WIDTH * HEIGHT


def test_attack_instances_take_it(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vlnhijack.experiments.views.coverage_table", None)
    measured = measure_coverage(folder, load_house(folder), lambda views: None)
    house = load_house(folder)
    path = house.graph.viewpoints[:2]
    episode = Episode(1, house.name, path, 0.0, "go", "1_0", 2.0)
    save_episodes(folder / "episodes" / "val_seen.json", [episode])
    wanted = DatasetInstances.model_validate({"dataset": "houses", "visibility": "masks"})
    (scan,) = load_scans(folder.parent, wanted)
    found = {(place.viewpoint, place.object_id): place.coverage for place in scan.places}
    for row, viewpoint in enumerate(house.graph.viewpoints):
        for column, thing in enumerate(house.objects):
            share = measured.pixels[row, :, column].max() / (WIDTH * HEIGHT)
            assert found[viewpoint, thing.id] == pytest.approx(share, abs=1e-6)


def test_a_house_without_it_has_none(folder: Path) -> None:
    assert load_coverage(folder, load_house(folder)) is None


def test_a_changed_house_makes_it_stale(folder: Path) -> None:
    measure_coverage(folder, load_house(folder), lambda views: None)
    objects = json.loads((folder / "objects.json").read_text())
    (folder / "objects.json").write_text(json.dumps(objects[::-1]))
    with pytest.raises(InputError, match="stale, measure it again"):
        load_coverage(folder, load_house(folder))


def test_saving_the_house_anew_drops_it(folder: Path) -> None:
    measure_coverage(folder, load_house(folder), lambda views: None)
    save_house(load_house(folder), folder)
    assert not (folder / FILE).exists()


@settings(
    max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_no_file_ends_in_a_traceback(folder: Path, data: st.DataObject) -> None:
    house = load_house(folder)
    if not (folder / "valid.json").exists():
        measure_coverage(folder, load_house(folder), lambda views: None)
        (folder / FILE).rename(folder / "valid.json")
    content = data.draw(texts(json.loads((folder / "valid.json").read_text())))
    refused_or_read(folder / FILE, content, lambda path: load_coverage(folder, house))
