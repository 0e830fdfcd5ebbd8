import pytest

from vlnhijack.errors import InputError, SetupError
from vlnhijack.rendering import variant


def test_a_gpu_that_is_not_there_is_one_clear_line(monkeypatch: pytest.MonkeyPatch) -> None:
    variant.activate()
    import drjit as dr

    monkeypatch.setenv(variant.SETTING, "cuda_ad_rgb")
    monkeypatch.setattr(dr, "has_backend", lambda backend: False)
    with pytest.raises(SetupError, match="VLNHIJACK_VARIANT=cuda_ad_rgb needs an NVIDIA GPU"):
        variant.activate.__wrapped__()


def test_an_unknown_variant_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(variant.SETTING, "scalar_rgb")
    with pytest.raises(InputError, match="VLNHIJACK_VARIANT: expected one of .*'cuda_ad_rgb'"):
        variant.activate.__wrapped__()
