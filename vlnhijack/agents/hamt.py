"""HAMT: History Aware Multimodal Transformer for VLN (Chen et al., NeurIPS 2021).

Matches VLN-HAMT's `finetune_src/models/vilmodel_cmt.py` (R2R and RxR variants); parameter names are
those of its checkpoints without their `vln_bert.` or `bert.` prefix.
"""

from collections.abc import Iterable
from typing import NamedTuple, cast

import torch
import torch.nn.functional as F
from torch import Tensor, nn

from vlnhijack.agents.hamt_config import HamtConfig
from vlnhijack.agents.hamt_layers import BertLayer, CrossLayer, Memory, additive_mask
from vlnhijack.agents.policy import Text
from vlnhijack.agents.precision import ALL

_VISUAL_EPS = 1e-12
_NAV_TYPES = 3
CLS = slice(0, 1)


class HamtOutputs(NamedTuple):
    logits: Tensor
    text: Tensor
    history: Tensor
    observation: Tensor


class TextEmbeddings(nn.Module):
    def __init__(self, config: HamtConfig) -> None:
        super().__init__()
        size = config.hidden_size
        self.word_embeddings = nn.Embedding(config.vocab_size, size, padding_idx=0)
        self.position_embeddings = nn.Embedding(config.max_position_embeddings, size)
        self.token_type_embeddings = nn.Embedding(config.type_vocab_size, size)
        self.LayerNorm = nn.LayerNorm(size, eps=config.layer_norm_eps)
        self.dropout = nn.Dropout(config.hidden_dropout)

    def forward(self, token_ids: Tensor) -> Tensor:
        positions = self.position_embeddings.weight[: token_ids.shape[1]]
        words = self.word_embeddings(token_ids)
        return self.dropout(
            self.LayerNorm(words + positions + self.token_type_embeddings.weight[0])
        )


class ImageEmbeddings(nn.Module):
    def __init__(self, config: HamtConfig) -> None:
        super().__init__()
        size = config.hidden_size
        self.img_linear = nn.Linear(config.image_feat_size, size)
        self.img_layer_norm = nn.LayerNorm(size, eps=_VISUAL_EPS)
        self.ang_linear = nn.Linear(config.angle_feat_size, size)
        self.ang_layer_norm = nn.LayerNorm(size, eps=_VISUAL_EPS)
        self.nav_type_embedding = nn.Embedding(_NAV_TYPES, size)
        self.layer_norm = nn.LayerNorm(size, eps=_VISUAL_EPS)
        self.dropout = nn.Dropout(config.hidden_dropout)

    def forward(self, image: Tensor, angle: Tensor, token_type: Tensor, nav_type: Tensor) -> Tensor:
        tokens = self.img_layer_norm(self.img_linear(image))
        tokens = tokens + self.ang_layer_norm(self.ang_linear(angle))
        tokens = tokens + token_type + self.nav_type_embedding(nav_type)
        return self.dropout(self.layer_norm(tokens))


class PanoramaEncoder(nn.Module):
    def __init__(self, config: HamtConfig) -> None:
        super().__init__()
        self.layer = nn.ModuleList(BertLayer(config) for _ in range(config.num_h_pano_layers))

    def forward(self, views: Tensor) -> Tensor:
        for layer in self.layer:
            views = layer(views, None)
        return views.mean(1)


class HistoryEmbeddings(nn.Module):
    def __init__(self, config: HamtConfig) -> None:
        super().__init__()
        size = config.hidden_size
        self.cls_token = nn.Parameter(torch.zeros(1, 1, size))
        self.img_linear = nn.Linear(config.image_feat_size, size)
        self.img_layer_norm = nn.LayerNorm(size, eps=_VISUAL_EPS)
        self.ang_linear = nn.Linear(config.angle_feat_size, size)
        self.ang_layer_norm = nn.LayerNorm(size, eps=_VISUAL_EPS)
        self.pano_img_linear = nn.Linear(config.image_feat_size, size)
        self.pano_img_layer_norm = nn.LayerNorm(size, eps=_VISUAL_EPS)
        self.pano_ang_linear = nn.Linear(config.angle_feat_size, size)
        self.pano_ang_layer_norm = nn.LayerNorm(size, eps=_VISUAL_EPS)
        self.pano_encoder = PanoramaEncoder(config)
        self.position_embeddings = nn.Embedding(config.max_action_steps, size)
        self.type_embedding = nn.Embedding(1, size)
        self.layer_norm = nn.LayerNorm(size, eps=_VISUAL_EPS)
        self.dropout = nn.Dropout(config.hidden_dropout)

    def first(self, batch: int) -> Tensor:
        token = self.layer_norm(self.cls_token[:, 0] + self.type_embedding.weight)
        return self.dropout(token.expand(batch, -1))

    def forward(
        self, image: Tensor, angle: Tensor, pano_image: Tensor, pano_angle: Tensor, step: Tensor
    ) -> Tensor:
        token = self.img_layer_norm(self.img_linear(image))
        token = token + self.ang_layer_norm(self.ang_linear(angle))
        token = token + self.position_embeddings(step) + self.type_embedding.weight
        views = self.pano_img_layer_norm(self.pano_img_linear(pano_image))
        views = views + self.pano_ang_layer_norm(self.pano_ang_linear(pano_angle))
        token = token + self.pano_encoder(self.dropout(views))
        return self.dropout(self.layer_norm(token))


class Encoder(nn.Module):
    def __init__(self, config: HamtConfig) -> None:
        super().__init__()
        self.layer = nn.ModuleList(BertLayer(config) for _ in range(config.num_l_layers))
        self.x_layers = nn.ModuleList(CrossLayer(config) for _ in range(config.num_x_layers))


class NextAction(nn.Module):
    def __init__(self, config: HamtConfig) -> None:
        super().__init__()
        size = config.hidden_size
        self.net = nn.Sequential(
            nn.Linear(size, size),
            nn.ReLU(),
            nn.LayerNorm(size, eps=_VISUAL_EPS),
            nn.Dropout(config.hidden_dropout),
            nn.Linear(size, 1),
        )

    def forward(self, tokens: Tensor) -> Tensor:
        return self.net(tokens).squeeze(-1)


class Hamt(nn.Module):
    """A `Policy`: see there for the shapes. Nothing is detached: history carries gradients."""

    def __init__(self, config: HamtConfig) -> None:
        super().__init__()
        self.config = config
        self.embeddings = TextEmbeddings(config)
        self.img_embeddings = ImageEmbeddings(config)
        self.hist_embeddings = HistoryEmbeddings(config)
        self.encoder = Encoder(config)
        self.next_action = NextAction(config)
        self.apply(_initialise)

    def encode_text(self, token_ids: Tensor, mask: Tensor) -> Text:
        """(B,T,H); with no_lang_ca, where vision changes no text, the keys and values (B,T,H) that
        each cross layer reads, layer after layer, and the last layer's text."""
        texts = self.text_layers(token_ids, mask)
        if not self.config.no_lang_ca:
            return texts[0]
        *read, _ = texts
        layers = zip(self._cross_layers(), read, strict=True)
        return (*(part for layer, text in layers for part in layer.memory(text)), read[-1])

    def text_layers(self, token_ids: Tensor, mask: Tensor) -> list[Tensor]:
        """The text (B,T,H); with no_lang_ca that of each cross layer and a last, unread one."""
        scores = additive_mask(mask, self.dtype)
        text = self.embeddings(token_ids)
        for layer in self.encoder.layer:
            text = layer(text, scores)
        if not self.config.no_lang_ca:
            return [text]
        return [text, *(cross.update_text(text, scores) for cross in self._cross_layers())]

    def history_cls(self, batch: int) -> Tensor:
        return self.hist_embeddings.first(batch)

    def encode_history(
        self, image: Tensor, angle: Tensor, pano_image: Tensor, pano_angle: Tensor, step: Tensor
    ) -> Tensor:
        image, pano_image = self._drop_features(image), self._drop_features(pano_image)
        return self.hist_embeddings(image, angle, pano_image, pano_angle, step)

    def forward(
        self,
        text: Text,
        text_mask: Tensor,
        history: Tensor,
        history_mask: Tensor,
        ob_image: Tensor,
        ob_angle: Tensor,
        nav_type: Tensor,
        ob_mask: Tensor,
    ) -> Tensor:
        """The logits of `outputs`; rows of the last layer that no logit reads are left out."""
        visual = torch.cat([history, self._embed_observation(ob_image, ob_angle, nav_type)], 1)
        masks = text_mask, torch.cat([history_mask, ob_mask], 1)
        start = history.shape[1]
        width = int(nav_type.any(0).nonzero().max()) + 1
        navigable = slice(start, start + width)
        new_text, tokens = self._cross(text, visual, masks, (CLS, navigable))
        logits = self._logits(new_text, tokens, nav_type[:, :width])
        return F.pad(logits, (0, nav_type.shape[1] - width), value=-torch.inf)

    def outputs(
        self,
        text: Text,
        text_mask: Tensor,
        history: Tensor,
        history_mask: Tensor,
        ob_image: Tensor,
        ob_angle: Tensor,
        nav_type: Tensor,
        ob_mask: Tensor,
    ) -> HamtOutputs:
        """Logits (B,N) and every token of the last layer: text (B,T,H), history (B,S,H) and
        observation (B,N,H)."""
        visual = torch.cat([history, self._embed_observation(ob_image, ob_angle, nav_type)], 1)
        masks = text_mask, torch.cat([history_mask, ob_mask], 1)
        new_text, tokens = self._cross(text, visual, masks, (ALL, ALL))
        new_history, new_observation = tokens.split([history.shape[1], nav_type.shape[1]], 1)
        logits = self._logits(new_text[:, CLS], new_observation, nav_type)
        return HamtOutputs(logits, new_text, new_history, new_observation)

    @property
    def dtype(self) -> torch.dtype:
        return self.hist_embeddings.cls_token.dtype

    def _drop_features(self, image: Tensor) -> Tensor:
        return F.dropout(image, self.config.feature_dropout, self.training)

    def _embed_observation(self, image: Tensor, angle: Tensor, nav_type: Tensor) -> Tensor:
        token_type = self.embeddings.token_type_embeddings.weight[1]
        return self.img_embeddings(self._drop_features(image), angle, token_type, nav_type)

    def _cross(
        self,
        text: Text,
        visual: Tensor,
        masks: tuple[Tensor, Tensor],
        last_rows: tuple[slice, slice],
    ) -> tuple[Tensor, Tensor]:
        """Runs the cross layers; the last one computes the given rows only."""
        text_scores, visual_scores = (additive_mask(mask, self.dtype) for mask in masks)
        current = text if isinstance(text, Tensor) else text[-1]
        for index, layer in enumerate(self._cross_layers()):
            is_last = index == self.config.num_x_layers - 1
            text_rows, visual_rows = last_rows if is_last else (ALL, ALL)
            if isinstance(text, tuple):
                read = Memory(*text[2 * index : 2 * index + 2])
                current = current[:, text_rows]
            else:
                read, seen = layer.memory(current), layer.memory(visual)
                current = layer.new_text(current, text_scores, seen, visual_scores, text_rows)
            visual = layer.new_visual(visual, visual_scores, read, text_scores, visual_rows)
        return current, visual

    def _cross_layers(self) -> Iterable[CrossLayer]:
        return cast(Iterable[CrossLayer], self.encoder.x_layers)

    def _logits(self, text_cls: Tensor, tokens: Tensor, nav_type: Tensor) -> Tensor:
        fused = tokens if self.config.no_lang_ca else tokens * text_cls
        return self.next_action(fused).masked_fill(nav_type == 0, -torch.inf)


def _initialise(module: nn.Module) -> None:
    """BERT's initialisation: weights N(0, 0.02), biases 0."""
    if isinstance(module, nn.Linear | nn.Embedding):
        nn.init.normal_(module.weight, std=0.02)
    if isinstance(module, nn.Linear):
        nn.init.zeros_(module.bias)
    if isinstance(module, nn.Embedding) and module.padding_idx is not None:
        with torch.no_grad():
            module.weight[module.padding_idx] = 0
