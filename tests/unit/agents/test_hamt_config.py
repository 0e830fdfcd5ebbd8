from dataclasses import asdict

import pytest

from vlnhijack.agents.hamt_config import HamtConfig
from vlnhijack.errors import InputError


def test_round_trip() -> None:
    config = HamtConfig(hidden_size=24, num_attention_heads=3, no_lang_ca=True)
    assert HamtConfig.from_mapping(asdict(config)) == config


def test_options_of_the_original_are_understood() -> None:
    values = {"hidden_act": "gelu", "num_h_layers": 0, "pad_token_id": 1, "vocab_size": 7}
    assert HamtConfig.from_mapping(values) == HamtConfig(vocab_size=7)


@pytest.mark.parametrize(
    ("values", "named"),
    [
        ({"num_h_layers": 2}, "num_h_layers"),
        ({"act_pred_token": "ob"}, "act_pred_token"),
        ({"hiden_size": 8}, "hiden_size"),
        ({"hidden_size": 10, "num_attention_heads": 4}, "hidden_size"),
        ({"num_x_layers": 0}, "num_x_layers"),
    ],
)
def test_other_variants_are_refused_by_name(values: dict, named: str) -> None:
    with pytest.raises(InputError, match=named):
        HamtConfig.from_mapping(values)
