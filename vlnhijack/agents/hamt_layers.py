"""Transformer layers of HAMT: BERT layers and cross-modal layers, official parameter names."""

from typing import NamedTuple

import torch
import torch.nn.functional as F
from torch import Tensor, nn

from vlnhijack.agents.hamt_config import HamtConfig
from vlnhijack.agents.precision import ALL, Linear, attend


def additive_mask(mask: Tensor, dtype: torch.dtype) -> Tensor:
    """(B,K) bool, true where a token exists, to (B,1,1,K) scores to add, as BERT does."""
    return (~mask).to(dtype)[:, None, None, :] * -10000.0


class Memory(NamedTuple):
    """Keys and values (B,K,H) of a context, before the heads part."""

    key: Tensor
    value: Tensor


class Attention(nn.Module):
    """Multi-head attention of queries (B,Q,H) to the memory of a context (B,K,H)."""

    def __init__(self, config: HamtConfig) -> None:
        super().__init__()
        self.heads = config.num_attention_heads
        self.dropout = config.attention_dropout
        self.query = Linear(config.hidden_size, config.hidden_size)
        self.key = Linear(config.hidden_size, config.hidden_size)
        self.value = Linear(config.hidden_size, config.hidden_size)

    def memory(self, context: Tensor) -> Memory:
        return Memory(self.key(context), self.value(context))

    def forward(self, queries: Tensor, memory: Memory, mask: Tensor | None) -> Tensor:
        query, key, value = (
            tokens.unflatten(-1, (self.heads, -1)).transpose(1, 2)
            for tokens in (self.query(queries), *memory)
        )
        dropout = self.dropout if self.training else 0.0
        return attend(query, key, value, mask, dropout).transpose(1, 2).flatten(2)


class AddNorm(nn.Module):
    """Linear, dropout, residual sum, LayerNorm."""

    def __init__(self, config: HamtConfig, in_size: int) -> None:
        super().__init__()
        self.dense = Linear(in_size, config.hidden_size)
        self.LayerNorm = nn.LayerNorm(config.hidden_size, eps=config.layer_norm_eps)
        self.dropout = nn.Dropout(config.hidden_dropout)

    def forward(self, hidden: Tensor, residual: Tensor) -> Tensor:
        return self.LayerNorm(self.dropout(self.dense(hidden)) + residual)


class Intermediate(nn.Module):
    def __init__(self, config: HamtConfig) -> None:
        super().__init__()
        self.dense = Linear(config.hidden_size, config.intermediate_size)

    def forward(self, hidden: Tensor) -> Tensor:
        return F.gelu(self.dense(hidden))


class SelfAttention(nn.Module):
    """Self-attention with its output projection; only the given rows are computed."""

    def __init__(self, config: HamtConfig) -> None:
        super().__init__()
        self.self = Attention(config)
        self.output = AddNorm(config, config.hidden_size)

    def forward(self, hidden: Tensor, mask: Tensor | None, rows: slice = ALL) -> Tensor:
        queries = hidden[:, rows]
        return self.output(self.self(queries, self.self.memory(hidden), mask), queries)


class CrossAttention(nn.Module):
    """Attention to the other modality with its output projection."""

    def __init__(self, config: HamtConfig) -> None:
        super().__init__()
        self.att = Attention(config)
        self.output = AddNorm(config, config.hidden_size)

    def forward(self, hidden: Tensor, memory: Memory, mask: Tensor) -> Tensor:
        return self.output(self.att(hidden, memory, mask), hidden)


class BertLayer(nn.Module):
    def __init__(self, config: HamtConfig) -> None:
        super().__init__()
        self.attention = SelfAttention(config)
        self.intermediate = Intermediate(config)
        self.output = AddNorm(config, config.intermediate_size)

    def forward(self, hidden: Tensor, mask: Tensor | None) -> Tensor:
        attended = self.attention(hidden, mask)
        return self.output(self.intermediate(attended), attended)


class CrossLayer(nn.Module):
    """HAMT's LXRTXLayer: one shared cross-attention reads both old inputs, then each modality has
    self-attention and a feed-forward block. Only the given rows of the results are computed."""

    def __init__(self, config: HamtConfig) -> None:
        super().__init__()
        self.visual_attention = CrossAttention(config)
        self.lang_self_att = SelfAttention(config)
        self.lang_inter = Intermediate(config)
        self.lang_output = AddNorm(config, config.intermediate_size)
        self.visn_self_att = SelfAttention(config)
        self.visn_inter = Intermediate(config)
        self.visn_output = AddNorm(config, config.intermediate_size)

    def memory(self, tokens: Tensor) -> Memory:
        """What the other modality reads of these tokens."""
        return self.visual_attention.att.memory(tokens)

    def new_visual(
        self, visual: Tensor, mask: Tensor, text: Memory, text_mask: Tensor, rows: slice = ALL
    ) -> Tensor:
        attended = self.visual_attention(visual, text, text_mask)
        attended = self.visn_self_att(attended, mask, rows)
        return self.visn_output(self.visn_inter(attended), attended)

    def new_text(
        self, text: Tensor, mask: Tensor, visual: Memory, visual_mask: Tensor, rows: slice = ALL
    ) -> Tensor:
        return self.update_text(self.visual_attention(text, visual, visual_mask), mask, rows)

    def update_text(self, text: Tensor, mask: Tensor, rows: slice = ALL) -> Tensor:
        attended = self.lang_self_att(text, mask, rows)
        return self.lang_output(self.lang_inter(attended), attended)
