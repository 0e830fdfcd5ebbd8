"""Sizes and options of a HAMT policy."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from vlnhijack.errors import InputError

# What every released HAMT checkpoint has: the variant that `Hamt` implements. The padding id is
# ignored because padded tokens are masked.
_FIXED_OPTIONS = {
    "hidden_act": "gelu",
    "num_h_layers": 0,
    "hist_enc_pano": True,
    "act_pred_token": "ob_txt",
}
_IGNORED_OPTIONS = {"pad_token_id"}


@dataclass(frozen=True)
class HamtConfig:
    """Names and defaults are those of the official full-size R2R agent (VLN-HAMT).

    `no_lang_ca` is the RxR variant: language is not updated by vision. `feature_dropout` acts on
    image features; all three dropout rates act in training mode only.
    """

    hidden_size: int = 768
    num_attention_heads: int = 12
    intermediate_size: int = 3072
    layer_norm_eps: float = 1e-12
    max_position_embeddings: int = 512
    vocab_size: int = 30522
    type_vocab_size: int = 2
    max_action_steps: int = 100
    num_l_layers: int = 9
    num_x_layers: int = 4
    num_h_pano_layers: int = 2
    no_lang_ca: bool = False
    image_feat_size: int = 768
    angle_feat_size: int = 4
    hidden_dropout: float = 0.1
    attention_dropout: float = 0.1
    feature_dropout: float = 0.4

    def __post_init__(self) -> None:
        if self.num_attention_heads < 1 or self.hidden_size % self.num_attention_heads:
            raise InputError(
                field="hidden_size",
                expected=f"a multiple of num_attention_heads ({self.num_attention_heads})",
                received=self.hidden_size,
            )
        if self.num_x_layers < 1:
            raise InputError(
                field="num_x_layers", expected="at least 1", received=self.num_x_layers
            )

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> "HamtConfig":
        """From a JSON object with these names (HAMT's own configuration options are understood).

        Raises InputError for an unknown option or a variant that is not implemented.
        """
        known = {field.name for field in fields(cls)}
        for name, value in values.items():
            if name in _FIXED_OPTIONS and value != _FIXED_OPTIONS[name]:
                raise InputError(field=name, expected=_FIXED_OPTIONS[name], received=value)
            if name not in known | _FIXED_OPTIONS.keys() | _IGNORED_OPTIONS:
                raise InputError(field=name, expected="a HAMT option", received="an unknown name")
        return cls(**{name: value for name, value in values.items() if name in known})
