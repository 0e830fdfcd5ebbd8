"""Vision transformer (Dosovitskiy et al., ICLR 2021) with timm's parameter names."""

from dataclasses import dataclass

import torch
import torch.nn.functional as F
from torch import Tensor, nn

from vlnhijack.agents.precision import ALL, Linear, attend
from vlnhijack.errors import InputError

_EPS = 1e-6
CLS = slice(0, 1)


@dataclass(frozen=True)
class VitConfig:
    """Defaults are those of ViT-B/16. `image_size` is (height, width) in pixels."""

    image_size: tuple[int, int] = (224, 224)
    patch: int = 16
    dim: int = 768
    depth: int = 12
    heads: int = 12
    mlp_ratio: float = 4.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "image_size", tuple(self.image_size))
        if self.patch < 1 or any(side % self.patch for side in self.image_size):
            expected = f"multiples of the patch size {self.patch}"
            raise InputError(field="image_size", expected=expected, received=self.image_size)
        if self.heads < 1 or self.dim % self.heads:
            expected = f"a multiple of heads ({self.heads})"
            raise InputError(field="dim", expected=expected, received=self.dim)

    @property
    def grid(self) -> tuple[int, int]:
        """Rows and columns of patches."""
        return self.image_size[0] // self.patch, self.image_size[1] // self.patch

    @property
    def feature_size(self) -> int:
        return self.dim


class PatchEmbed(nn.Module):
    def __init__(self, config: VitConfig) -> None:
        super().__init__()
        self.proj = nn.Conv2d(3, config.dim, config.patch, config.patch)

    def forward(self, images: Tensor) -> Tensor:
        patches = F.pixel_unshuffle(images, self.proj.kernel_size[0]).flatten(2).transpose(1, 2)
        return F.linear(patches, self.proj.weight.flatten(1), self.proj.bias)


class Attention(nn.Module):
    def __init__(self, config: VitConfig) -> None:
        super().__init__()
        self.heads = config.heads
        self.qkv = Linear(config.dim, 3 * config.dim)
        self.proj = Linear(config.dim, config.dim)

    def forward(self, tokens: Tensor, rows: slice) -> Tensor:
        return self.proj(self_attention(self.qkv, tokens, rows, self.heads))


def self_attention(packed: Linear, tokens: Tensor, rows: slice, heads: int) -> Tensor:
    """What the given rows of tokens (B,N,W) attend to in all, (B,R,W); `packed` makes queries, keys
    and values, one after the other."""
    width = tokens.shape[-1]
    queries = packed(tokens[:, rows], slice(width))
    keys, values = packed(tokens, slice(width, None)).chunk(2, -1)
    query, key, value = (
        part.unflatten(-1, (heads, -1)).transpose(1, 2) for part in (queries, keys, values)
    )
    return attend(query, key, value).transpose(1, 2).flatten(2)


class Mlp(nn.Module):
    def __init__(self, config: VitConfig) -> None:
        super().__init__()
        hidden = round(config.dim * config.mlp_ratio)
        self.fc1 = Linear(config.dim, hidden)
        self.fc2 = Linear(hidden, config.dim)

    def forward(self, tokens: Tensor) -> Tensor:
        return self.fc2(F.gelu(self.fc1(tokens)))


class Block(nn.Module):
    """Pre-norm transformer block; only the given rows of the result are computed."""

    def __init__(self, config: VitConfig) -> None:
        super().__init__()
        self.norm1 = nn.LayerNorm(config.dim, eps=_EPS)
        self.attn = Attention(config)
        self.norm2 = nn.LayerNorm(config.dim, eps=_EPS)
        self.mlp = Mlp(config)

    def forward(self, tokens: Tensor, rows: slice = ALL) -> Tensor:
        attended = tokens[:, rows] + self.attn(self.norm1(tokens), rows)
        return attended + self.mlp(self.norm2(attended))


class VisionTransformer(nn.Module):
    """Images (V,3,H,W), already normalised, to the normalised CLS token (V,D)."""

    def __init__(self, config: VitConfig) -> None:
        super().__init__()
        self.config = config
        rows, columns = config.grid
        self.cls_token = nn.Parameter(torch.zeros(1, 1, config.dim))
        self.pos_embed = nn.Parameter(torch.zeros(1, 1 + rows * columns, config.dim))
        self.patch_embed = PatchEmbed(config)
        self.blocks = nn.ModuleList(Block(config) for _ in range(config.depth))
        self.norm = nn.LayerNorm(config.dim, eps=_EPS)
        nn.init.trunc_normal_(self.pos_embed, std=0.02)
        self.apply(_initialise)

    def forward(self, images: Tensor) -> Tensor:
        return self._encode(images, CLS)[:, 0]

    def forward_tokens(self, images: Tensor) -> Tensor:
        """Every normalised token, (V,1+P,D): CLS, then the patches row by row."""
        return self._encode(images, ALL)

    def _encode(self, images: Tensor, rows: slice) -> Tensor:
        patches = self.patch_embed(images)
        cls = self.cls_token.expand(len(images), -1, -1)
        tokens = torch.cat([cls, patches], 1) + self.pos_embed
        last = len(self.blocks) - 1
        for index, block in enumerate(self.blocks):
            tokens = block(tokens, rows if index == last else ALL)
        return self.norm(tokens)


def _initialise(module: nn.Module) -> None:
    if isinstance(module, nn.Linear):
        nn.init.trunc_normal_(module.weight, std=0.02)
        nn.init.zeros_(module.bias)
