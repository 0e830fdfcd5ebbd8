"""The exception tree.

VlnHijackError
├── InputError   a file, setting or argument is not what it has to be
├── SetupError   the machine lacks something that vlnhijack needs
└── CheckError   a self-check of a result failed, so the result is not given
"""

from os import PathLike


class VlnHijackError(Exception):
    """Every error that vlnhijack raises on purpose; its text is one clear line."""


class InputError(VlnHijackError):
    """Bad input, named by file, field, expected and received."""

    def __init__(
        self,
        message: str = "",
        *,
        file: str | PathLike[str] | None = None,
        field: str | None = None,
        expected: object = None,
        received: object = None,
    ) -> None:
        where = ": ".join(str(part) for part in (file, field) if part is not None)
        what = message
        if expected is not None:
            what += f"{'; ' if what else ''}expected {expected}, received {_short(received)}"
        text = f"{where}: {what}" if where and what else where or what
        super().__init__(" ".join(text.split()))


class SetupError(VlnHijackError):
    """Something is missing on this machine; the text says how to get it."""


class CheckError(VlnHijackError):
    """A self-check failed: baseline gate, apply check, non-finite gradient."""


def _short(value: object, limit: int = 120) -> str:
    text = repr(value) if isinstance(value, str) else str(value)
    text = " ".join(text.split())
    return text if len(text) <= limit else text[: limit - 1] + "…"
