import pytest
import torch

from vlnhijack.agents.resize import pil_gap, resize_and_crop, resize_matrices


def test_images_of_the_right_size_are_untouched() -> None:
    images = torch.rand(2, 3, 12, 16)
    assert resize_and_crop(images, (12, 16)) is images


@pytest.mark.parametrize("shape", [(480, 640), (640, 480), (300, 300), (100, 90)])
def test_any_image_is_resized(shape: tuple[int, int]) -> None:
    resized = resize_and_crop(torch.full((1, 3, *shape), 0.25), (224, 224))
    assert resized.shape == (1, 3, 224, 224)
    torch.testing.assert_close(resized, torch.full_like(resized, 0.25))


def test_crop_is_central_and_keeps_the_scale() -> None:
    """A ramp over columns: 640 wide becomes 330 wide, of which the middle 224 remain."""
    ramp = torch.linspace(0, 1, 640).expand(1, 3, 480, 640)
    middle = resize_and_crop(ramp, (224, 224))[0, 0, 112]
    assert middle.mean().item() == pytest.approx(0.5, abs=1e-4)
    assert (middle[-1] - middle[0]).item() == pytest.approx(223 / 330, abs=2e-3)


@pytest.mark.parametrize("shape", [(60, 80), (80, 60), (20, 24), (17, 33)])
def test_matrices_are_the_resize(shape: tuple[int, int]) -> None:
    images = torch.rand(2, 3, *shape, generator=torch.Generator().manual_seed(0))
    vertical, horizontal = resize_matrices(shape, (20, 24))
    assert (vertical.shape, horizontal.shape) == ((20, shape[0]), (24, shape[1]))
    expected = resize_and_crop(images, (20, 24))
    torch.testing.assert_close(vertical @ images @ horizontal.T, expected, atol=1e-5, rtol=0)


def test_pil_differs_by_its_rounding_and_where_it_clips() -> None:
    """Far from black and white by the rounding of pixels and of PIL's two passes alone."""
    random = torch.Generator().manual_seed(0)
    images = 0.3 + 0.4 * torch.rand(2, 3, 60, 80, generator=random)
    mean, largest = pil_gap(images, (20, 24))
    assert 0 < mean < 0.5 / 255
    assert largest < 2 / 255
    steps = (torch.arange(80) % 16 < 8).float().expand(1, 3, 60, 80)
    assert pil_gap(steps, (40, 56))[1] > 4 / 255
