"""Mitsuba with a variant set, after the check that its LLVM will not abort the process."""

from functools import cache
from typing import Any

from vlnhijack.llvm import require_llvm

DEFAULT = "llvm_ad_rgb"


@cache
def activate() -> Any:
    """The mitsuba module; a variant that is already set is kept, else `llvm_ad_rgb`.

    Call it instead of importing mitsuba: the import itself loads libLLVM. Raises SetupError where
    LLVM is missing or too old.
    """
    require_llvm()
    import mitsuba

    if mitsuba.variant() is None:
        mitsuba.set_variant(DEFAULT)
    return mitsuba
