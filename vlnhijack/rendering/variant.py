"""Mitsuba with a variant set, after the check that its backend works here."""

import os
from functools import cache
from typing import Any, Literal, get_args

from vlnhijack.errors import InputError, SetupError
from vlnhijack.llvm import require_llvm

Variant = Literal["llvm_ad_rgb", "cuda_ad_rgb"]
DEFAULT: Variant = "llvm_ad_rgb"
SETTING = "VLNHIJACK_VARIANT"


@cache
def activate() -> Any:
    """The mitsuba module; a variant that is already set is kept, else `chosen()` is set.

    Call it instead of importing mitsuba: the import itself loads libLLVM. Raises SetupError where
    LLVM is missing or too old, or where there is no GPU for a CUDA variant.
    """
    variant = chosen()
    if variant.startswith("llvm"):
        require_llvm()
    import drjit as dr
    import mitsuba

    if variant.startswith("cuda") and not dr.has_backend(dr.JitBackend.CUDA):
        raise SetupError(
            f"{SETTING}={variant} needs an NVIDIA GPU with driver, and none is found; unset it to "
            f"render with {DEFAULT}"
        )
    if mitsuba.variant() is None:
        mitsuba.set_variant(variant)
    return mitsuba


def chosen() -> Variant:
    """The variant that VLNHIJACK_VARIANT names, else `llvm_ad_rgb`; InputError for another name."""
    name = os.environ.get(SETTING, DEFAULT)
    for variant in get_args(Variant):
        if name == variant:
            return variant
    raise InputError(field=SETTING, expected=f"one of {get_args(Variant)}", received=name)


def torch_device() -> str:
    """Where the tensors of the active variant lie: "cuda" or "cpu"."""
    return "cuda" if activate().variant().startswith("cuda") else "cpu"
