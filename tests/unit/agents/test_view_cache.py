from pathlib import Path

import numpy as np
import pytest
import torch

from vlnhijack.agents.view_cache import cached_views

TEXTURE = np.linspace(0, 1, 12, dtype=np.float32).reshape(2, 2, 3)
VIEWS = torch.tensor([[3, 12], [3, 13]])


def test_a_view_of_a_texture_is_encoded_once(tmp_path: Path) -> None:
    features = torch.arange(8.0).view(2, 4)
    first = cached_views(tmp_path, "agent a", TEXTURE, VIEWS, lambda: features)
    again = cached_views(tmp_path, "agent a", TEXTURE.copy(), VIEWS, pytest.fail)
    assert torch.equal(first, features)
    assert torch.equal(again, features)


@pytest.mark.parametrize("cause", ["made_by", "texture", "shape", "views"])
def test_whatever_the_features_hang_on_is_part_of_the_key(tmp_path: Path, cause: str) -> None:
    given = {"made_by": "agent a", "texture": TEXTURE, "views": VIEWS}
    other = {
        "made_by": {"made_by": "agent b"},
        "texture": {"texture": TEXTURE + np.float32(1 / 255)},
        "shape": {"texture": TEXTURE.reshape(1, 4, 3)},
        "views": {"views": VIEWS.flip(0)},
    }
    cached_views(tmp_path, **given, encode=lambda: torch.zeros(2, 4))
    found = cached_views(tmp_path, **{**given, **other[cause]}, encode=lambda: torch.ones(2, 4))
    assert found.all()
