import numpy as np
import pytest

from vlnhijack.errors import InputError
from vlnhijack.navigation.views import (
    VIEWS,
    angle_features,
    nearest_view,
    panorama_cameras,
    parse_views,
    view_angles,
)


def test_rows_look_down_ahead_and_up() -> None:
    assert view_angles(0) == pytest.approx((0, -np.pi / 6))
    assert view_angles(15) == pytest.approx((np.pi / 2, 0))
    assert view_angles(35) == pytest.approx((11 * np.pi / 6, np.pi / 6))


@pytest.mark.parametrize("index", [-1, 36])
def test_an_index_outside_the_panorama_is_refused(index: int) -> None:
    with pytest.raises(InputError, match="view"):
        view_angles(index)


@pytest.mark.parametrize(
    ("text", "views"),
    [("0-35", list(range(VIEWS))), ("7", [7]), ("12-14, 3,5,13", [3, 5, 12, 13, 14])],
)
def test_a_list_of_views_is_parsed(text: str, views: list[int]) -> None:
    assert parse_views(text) == views


@pytest.mark.parametrize("text", ["", "36", "-1", "5-3", "1-", "a", "1,,2", "0-36", "1.5"])
def test_a_list_of_no_views_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="views: expected indices in .0, 36.*received"):
        parse_views(text)


def test_cameras_share_the_position_and_take_the_angles_of_the_views() -> None:
    cameras = panorama_cameras((1.0, 2.0, 1.5), 96, 72)
    assert len(cameras) == VIEWS
    assert {camera.position for camera in cameras} == {(1.0, 2.0, 1.5)}
    assert [(c.heading, c.elevation) for c in cameras] == [view_angles(i) for i in range(VIEWS)]
    assert (cameras[0].width, cameras[0].height) == (96, 72)


def test_angle_features_are_relative_to_the_base_heading_only() -> None:
    features = angle_features(27)
    assert features.shape == (36, 4) and features.dtype == np.float32
    assert features[15] == pytest.approx([0, 1, 0, 1])
    assert features[3] == pytest.approx([0, 1, -0.5, np.sqrt(0.75)])


@pytest.mark.parametrize(("degrees", "view"), [(0, 12), (14, 12), (16, 13), (350, 12), (-40, 23)])
def test_a_heading_snaps_to_the_nearest_view(degrees: float, view: int) -> None:
    assert nearest_view(np.radians(degrees)) == view
