"""CLIP's vision transformer (Radford et al., ICML 2021) with the names of OpenAI's `visual.*`,
but for `attn.in_proj.*`."""

from collections import OrderedDict
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from vlnhijack.agents.precision import ALL, Linear
from vlnhijack.agents.vit import CLS, self_attention
from vlnhijack.errors import InputError

_EPS = 1e-5
_MLP_RATIO = 4


@dataclass(frozen=True)
class ClipConfig:
    """Defaults are those of CLIP ViT-B/32. `image_size` is (height, width) in pixels."""

    image_size: tuple[int, int] = (224, 224)
    patch: int = 32
    width: int = 768
    layers: int = 12
    heads: int = 12
    out: int = 512

    def __post_init__(self) -> None:
        object.__setattr__(self, "image_size", tuple(self.image_size))
        if self.patch < 1 or any(side % self.patch for side in self.image_size):
            expected = f"multiples of the patch size {self.patch}"
            raise InputError(field="image_size", expected=expected, received=self.image_size)
        if self.heads < 1 or self.width % self.heads:
            expected = f"a multiple of heads ({self.heads})"
            raise InputError(field="width", expected=expected, received=self.width)

    @property
    def feature_size(self) -> int:
        return self.out

    @property
    def patches(self) -> int:
        return (self.image_size[0] // self.patch) * (self.image_size[1] // self.patch)


class QuickGelu(nn.Module):
    def forward(self, tokens: Tensor) -> Tensor:
        return tokens * torch.sigmoid(1.702 * tokens)


class Attention(nn.Module):
    def __init__(self, config: ClipConfig) -> None:
        super().__init__()
        self.heads = config.heads
        self.in_proj = Linear(config.width, 3 * config.width)
        self.out_proj = Linear(config.width, config.width)

    def forward(self, tokens: Tensor, rows: slice) -> Tensor:
        return self.out_proj(self_attention(self.in_proj, tokens, rows, self.heads))


class Block(nn.Module):
    """Pre-norm transformer block; only the given rows of the result are computed."""

    def __init__(self, config: ClipConfig) -> None:
        super().__init__()
        width = config.width
        self.ln_1 = nn.LayerNorm(width, eps=_EPS)
        self.attn = Attention(config)
        self.ln_2 = nn.LayerNorm(width, eps=_EPS)
        self.mlp = nn.Sequential(
            OrderedDict(
                c_fc=Linear(width, _MLP_RATIO * width),
                gelu=QuickGelu(),
                c_proj=Linear(_MLP_RATIO * width, width),
            )
        )

    def forward(self, tokens: Tensor, rows: slice = ALL) -> Tensor:
        attended = tokens[:, rows] + self.attn(self.ln_1(tokens), rows)
        return attended + self.mlp(self.ln_2(attended))


class Transformer(nn.Module):
    def __init__(self, config: ClipConfig) -> None:
        super().__init__()
        self.resblocks = nn.ModuleList(Block(config) for _ in range(config.layers))

    def forward(self, tokens: Tensor) -> Tensor:
        """The CLS token (V,1,W); the last block computes no other."""
        last = len(self.resblocks) - 1
        for index, block in enumerate(self.resblocks):
            tokens = block(tokens, CLS if index == last else ALL)
        return tokens[:, CLS]


class ClipVisual(nn.Module):
    """Images (V,3,H,W), already normalised, to projected features (V,out), not normalised."""

    def __init__(self, config: ClipConfig) -> None:
        super().__init__()
        self.config = config
        width, scale = config.width, config.width**-0.5
        self.class_embedding = nn.Parameter(scale * torch.randn(width))
        self.positional_embedding = nn.Parameter(scale * torch.randn(1 + config.patches, width))
        self.proj = nn.Parameter(scale * torch.randn(width, config.out))
        self.conv1 = nn.Conv2d(3, width, config.patch, config.patch, bias=False)
        self.ln_pre = nn.LayerNorm(width, eps=_EPS)
        self.transformer = Transformer(config)
        self.ln_post = nn.LayerNorm(width, eps=_EPS)

    def forward(self, images: Tensor) -> Tensor:
        patches = self.conv1(images).flatten(2).transpose(1, 2)
        cls = self.class_embedding.expand(len(images), 1, -1)
        tokens = self.ln_pre(torch.cat([cls, patches], 1) + self.positional_embedding)
        return self.ln_post(self.transformer(tokens)[:, 0]) @ self.proj
