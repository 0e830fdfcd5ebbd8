"""Files that are whole or absent: written beside their place, hashed, then renamed.

JSON and JSONL are read from plain files and from gzipped ones, whose names end in .gz.
"""

import gzip
import hashlib
import json
import os
import re
import shutil
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO, TypeVar

from pydantic import TypeAdapter, ValidationError

from vlnhijack.errors import InputError

T = TypeVar("T")

_CHUNK = 1 << 20
_LONGEST_ITEM = 1 << 26
_TAIL = 3  # characters after a number that show where it ends: 1 may go on as 1e+5
_SPACE = re.compile(r"[ \t\n\r]*")


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """An OSError of the block that names no file, such as that of a full disk, names `path`."""
    try:
        yield
    except OSError as error:
        error.filename = error.filename or str(path)
        raise


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """A temporary path with the same suffix that replaces `path` when the block succeeds."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(
        dir=path.parent, prefix=f".{path.stem}.", suffix="".join(path.suffixes[-1:])
    )
    os.close(handle)
    temporary = Path(name)
    try:
        with _named(path):
            yield temporary
        temporary.chmod(0o644)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def require_replaceable(folder: Path, sign: str) -> None:
    """InputError where there are other files, those of a folder without `sign`, to be lost."""
    if not folder.exists() or (folder / sign).exists():
        return
    if not folder.is_dir() or any(folder.iterdir()):
        expected = f"a new or empty folder, or one with {sign}"
        raise InputError(file=folder, expected=expected, received="other files")


@contextmanager
def atomic_folder(path: Path) -> Iterator[Path]:
    """A temporary folder that replaces `path` (if any) when the block succeeds."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = Path(tempfile.mkdtemp(dir=path.parent, prefix=f".{path.name}."))
    try:
        with _named(path):
            yield temporary
        temporary.chmod(0o755)
        if path.exists():
            shutil.rmtree(path)
        temporary.replace(path)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def write_bytes(path: Path, content: bytes) -> None:
    with atomic_path(path) as temporary:
        temporary.write_bytes(content)


def write_text(path: Path, content: str) -> None:
    write_bytes(path, content.encode())


def write_json(path: Path, value: Any) -> None:
    write_text(path, json.dumps(value, indent=1, ensure_ascii=False) + "\n")


@contextmanager
def open_text(path: Path) -> Iterator[TextIO]:
    """A UTF-8 text file, gunzipped where its name ends in .gz; InputError where it is none."""
    try:
        if path.suffix == ".gz":
            with gzip.open(path, "rt", encoding="utf-8") as file:
                yield file
        else:
            with path.open(encoding="utf-8") as file:
                yield file
    except FileNotFoundError:
        raise InputError(file=path, expected="a file", received="no such file") from None
    except (UnicodeDecodeError, EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise InputError(f"not a readable text file ({error})", file=path) from None


def read_json(path: Path) -> Any:
    """The parsed file; raises InputError where it is missing or not JSON."""
    with open_text(path) as file:
        return parse_json(file.read(), path)


def parse_json(text: str | bytes, path: Path, field: str | None = None) -> Any:
    """The parsed text, which is the file at `path` or its part `field`; InputError if not JSON."""
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"not valid JSON ({error})", file=path, field=field) from None


def validated(form: TypeAdapter[T], value: Any, path: Path, where: str = "") -> T:
    """The value in the given form; raises InputError with file, record (`where`) and field."""
    try:
        return form.validate_python(value)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        missing = first["type"] == "missing"
        raise InputError(
            file=path,
            field=": ".join(filter(None, [where, ".".join(map(str, first["loc"]))])) or None,
            expected="a value" if missing else first["msg"].removeprefix("Input should be "),
            received="none" if missing else first["input"],
        ) from None


def stream_json_lines(path: Path) -> Iterator[Any]:
    """The values of a JSONL file, one at a time; InputError names the line that is not JSON."""
    with open_text(path) as file:
        for number, line in enumerate(file, 1):
            if line.strip():
                yield parse_json(line, path, f"line {number}")


def stream_json_list(path: Path) -> Iterator[Any]:
    """The items of a JSON list, one at a time, so that a file may be larger than the memory.

    Raises InputError where the file is not a list of items of at most 64 Mi characters.
    """
    with open_text(path) as file:
        reader = _JsonReader(file, path, "list")
        for number, _ in enumerate(reader.places("[", "]"), 1):
            item = reader.item()
            reader.where = f"record {number}"
            yield item


def stream_json_object(path: Path) -> Iterator[tuple[str, Any]]:
    """The keys and values of a JSON object; the same otherwise. Each key may come once."""
    known: set[str] = set()
    with open_text(path) as file:
        reader = _JsonReader(file, path, "object")
        for _ in reader.places("{", "}"):
            key = reader.item()
            if not isinstance(key, str) or key in known:
                expected = "a text that is no key yet"
                raise InputError(file=path, field=reader.where, expected=expected, received=key)
            known.add(key)
            reader.where = key
            reader.expect(":")
            yield key, reader.item()


class _JsonReader:
    """Cuts a JSON list or object (`kind`) into items while its text is read piece by piece.

    where: the place in the file that errors name.
    """

    def __init__(self, file: TextIO, path: Path, kind: str) -> None:
        self._file, self._path, self._kind = file, path, kind
        self._text, self._at, self.where = "", 0, "record 0"
        self._decoder = json.JSONDecoder(object_pairs_hook=self._unique)

    def places(self, opening: str, closing: str) -> Iterator[None]:
        """Stop before each item; at last, go past the end, which is that of the file."""
        self.expect(opening)
        if self.peek() == closing:
            self.expect(closing)
        else:
            yield
            while self.expect("," + closing) == ",":
                yield
        if self.peek():
            expected = f"nothing after the {self._kind}"
            raise InputError(file=self._path, expected=expected, received=self.peek())

    def peek(self) -> str:
        """The next character that is not white space, "" at the end."""
        while True:
            space = _SPACE.match(self._text, self._at)
            self._at = space.end() if space else self._at
            if self._at < len(self._text) or not self._more():
                return self._text[self._at : self._at + 1]

    def expect(self, allowed: str) -> str:
        """Go past the next character, which is one of `allowed`."""
        found = self.peek()
        if not found or found not in allowed:
            raise InputError(
                file=self._path,
                field=self.where,
                expected=f"a JSON {self._kind} with {' or '.join(allowed)} here",
                received=found or "the end of the file",
            )
        self._at += 1
        return found

    def item(self) -> Any:
        """Go past the next item, reading on until what follows shows that it is whole."""
        self.peek()
        while True:
            try:
                value, end = self._decoder.raw_decode(self._text, self._at)
                length = end - self._at
                if len(self._text) - end >= _TAIL or not self._more():
                    self._at += length
                    return value
            except (ValueError, RecursionError) as error:
                if len(self._text) - self._at > _LONGEST_ITEM or not self._more():
                    raise InputError(
                        f"not valid JSON ({error})", file=self._path, field=self.where
                    ) from None

    def _unique(self, pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        found = dict(pairs)
        if len(found) < len(pairs):
            twice = next(key for key in found if sum(key == other for other, _ in pairs) > 1)
            raise InputError(
                file=self._path, field=self.where, expected="each key once", received=twice
            )
        return found

    def _more(self) -> bool:
        """Read on, at least as much as is left, so that a long item costs linear time."""
        left = self._text[self._at :]
        piece = self._file.read(max(_CHUNK, len(left)))
        self._text, self._at = left + piece, 0
        return bool(piece)


def append_row(path: Path, row: dict[str, Any]) -> None:
    """Add a line to a JSONL file."""
    with _named(path), path.open("a") as file:
        file.write(json.dumps(row) + "\n")


def read_rows(path: Path) -> list[dict[str, Any]]:
    """Rows of a JSONL file; a last line cut off by a crash is dropped, a missing file is empty."""
    if not path.exists():
        return []
    rows = []
    for line in path.read_text().splitlines():
        try:
            rows.append(json.loads(line))
        except json.JSONDecodeError:
            break
    return rows


def sha256(path: Path) -> str:
    """Hexadecimal SHA-256 of a file's content."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
