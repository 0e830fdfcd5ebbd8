import pytest
import torch

from vlnhijack.agents.encoder import VitEncoder, resize_and_crop
from vlnhijack.agents.vit import VisionTransformer, VitConfig


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


def test_features_are_differentiable_and_normalised() -> None:
    torch.manual_seed(0)
    vit = VisionTransformer(VitConfig((12, 16), patch=4, dim=8, depth=1, heads=2)).eval()
    encoder = VitEncoder(vit)
    images = torch.rand(2, 3, 12, 16, requires_grad=True)
    features = encoder(images)
    assert features.shape == (2, encoder.feature_size)
    assert encoder.image_size == (12, 16)
    torch.testing.assert_close(features, vit((images - 0.5) / 0.5))
    features[0, 0].backward()
    assert images.grad is not None
    assert images.grad[0].abs().sum() > 0
    assert images.grad[1].abs().sum() == 0
