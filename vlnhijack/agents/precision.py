"""In which precision the transformer layers of an agent multiply.

Sums of residuals and normalisations between the products stay in float32, by type promotion.
"""

from typing import Literal

import torch
import torch.nn.functional as F
from torch import Tensor, nn

Precision = Literal["float32", "bfloat16"]
ALL = slice(None)

_LARGE = 512


class Linear(nn.Linear):
    """Multiplies in the precision of its weights; only the given channels of the result."""

    def forward(self, tokens: Tensor, channels: slice = ALL) -> Tensor:
        tokens = tokens.to(self.weight.dtype)
        return F.linear(tokens, self.weight[channels], self.bias[channels])


def attend(
    query: Tensor, key: Tensor, value: Tensor, mask: Tensor | None = None, dropout: float = 0.0
) -> Tensor:
    """Attention (B,heads,Q,d) of queries to keys and values (B,heads,K,d); mask: scores to add.

    In bfloat16 on a CPU, plain products take a third of the time of PyTorch's own function.
    """
    if mask is not None:
        mask = mask.to(query.dtype)
    if query.dtype == torch.bfloat16 and query.device.type == "cpu":
        scores = (query / query.shape[-1] ** 0.5) @ key.mT
        weights = (scores if mask is None else scores + mask).softmax(-1)
        return F.dropout(weights, dropout) @ value
    return F.scaled_dot_product_attention(query, key, value, mask, dropout)


def set_precision(model: nn.Module, precision: Precision) -> None:
    """Round the weights of the model's `Linear` layers, once for all calls; in place."""
    for module in model.modules():
        if isinstance(module, Linear):
            module.to(getattr(torch, precision))


def default_precision(width: int) -> Precision:
    """bfloat16 for layers of 512 channels or more, which gain from it; see docs/benchmarks.md."""
    return "bfloat16" if width >= _LARGE else "float32"
