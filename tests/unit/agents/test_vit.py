from dataclasses import asdict

import pytest
import torch

from vlnhijack.agents.vit import VisionTransformer, VitConfig
from vlnhijack.errors import InputError

CONFIG = VitConfig(image_size=(12, 20), patch=4, dim=16, depth=2, heads=2)


@pytest.fixture
def vit() -> VisionTransformer:
    torch.manual_seed(0)
    return VisionTransformer(CONFIG).eval()


def test_feature_is_the_first_token(vit: VisionTransformer) -> None:
    images = torch.randn(3, 3, 12, 20)
    tokens = vit.forward_tokens(images)
    assert tokens.shape == (3, 1 + 3 * 5, 16)
    torch.testing.assert_close(vit(images), tokens[:, 0], rtol=1e-5, atol=1e-5)


def test_patches_are_row_by_row(vit: VisionTransformer) -> None:
    images = torch.zeros(1, 3, 12, 20)
    images[:, :, 4:8, 12:16] = 1
    patches = vit.patch_embed(images)
    changed = (patches - patches[:, :1]).abs().sum(-1)[0].nonzero()
    assert changed.tolist() == [[1 * 5 + 3]]


def test_views_do_not_influence_each_other(vit: VisionTransformer) -> None:
    images = torch.randn(2, 3, 12, 20)
    torch.testing.assert_close(vit(images)[1:], vit(images[1:]), rtol=1e-5, atol=1e-5)


def test_parameter_names_are_those_of_timm(vit: VisionTransformer) -> None:
    names = set(vit.state_dict())
    parts = ("norm1", "attn.qkv", "attn.proj", "norm2", "mlp.fc1", "mlp.fc2")
    modules = [f"blocks.{block}.{part}" for block in range(2) for part in parts]
    modules += ["patch_embed.proj", "norm"]
    weights = {f"{module}.{kind}" for module in modules for kind in ("weight", "bias")}
    assert names == weights | {"cls_token", "pos_embed"}


@pytest.mark.parametrize("wrong", [{"image_size": (13, 20)}, {"heads": 3}])
def test_sizes_that_do_not_divide_are_refused(wrong: dict) -> None:
    with pytest.raises(InputError):
        VitConfig(**{**asdict(CONFIG), **wrong})


def test_patches_are_embedded_as_by_the_convolution(vit: VisionTransformer) -> None:
    images = torch.randn(2, 3, 12, 20)
    expected = vit.patch_embed.proj(images).flatten(2).transpose(1, 2)
    torch.testing.assert_close(vit.patch_embed(images), expected, rtol=1e-5, atol=1e-5)
