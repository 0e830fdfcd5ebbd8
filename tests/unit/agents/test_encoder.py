import torch

from vlnhijack.agents.encoder import VitEncoder
from vlnhijack.agents.vit import VisionTransformer, VitConfig


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
