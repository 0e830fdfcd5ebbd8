"""The zip archives in which Matterport3D is handed out."""

import lzma
import shutil
import stat
import struct
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from vlnhijack.errors import InputError

_LARGEST_MEMBER = 1 << 28  # bytes, of those that are read into memory
_BROKEN = (
    zipfile.BadZipFile,
    zlib.error,
    lzma.LZMAError,
    struct.error,
    EOFError,
    OSError,
    RuntimeError,
    ValueError,
)


def unpack(archive: Path, folder: Path) -> None:
    """Unpack an archive into a folder.

    Raises InputError, before anything is written, where a member points outside the folder or the
    disk has no room for all of them, and where the archive is broken.
    """
    with _opened(archive) as members:
        infos = members.infolist()
        for info in infos:
            inside = (folder / info.filename).resolve().is_relative_to(folder.resolve())
            if not inside or stat.S_ISLNK(info.external_attr >> 16):
                raise InputError(
                    file=archive,
                    field="members",
                    expected="files inside the folder",
                    received=info.filename,
                )
        folder.mkdir(parents=True, exist_ok=True)
        needed, free = sum(info.file_size for info in infos), shutil.disk_usage(folder).free
        if needed > free:
            raise InputError(
                file=archive,
                expected=f"≥ {needed / 1e9:.1f} GB of disk for its files in {folder}",
                received=f"{free / 1e9:.1f} GB",
            )
        members.extractall(folder)


def read_members(archive: Path, names: Sequence[str]) -> dict[str, bytes]:
    """The members whose file names, without folders, are among `names`; InputError where broken."""
    with _opened(archive) as members:
        found = {Path(info.filename).name: info for info in members.infolist()}
        wanted = {name: found[name] for name in names if name in found}
        for name, info in wanted.items():
            if info.file_size > _LARGEST_MEMBER:
                raise InputError(
                    file=archive,
                    field=name,
                    expected=f"≤ {_LARGEST_MEMBER} bytes",
                    received=info.file_size,
                )
        return {name: members.read(info) for name, info in wanted.items()}


@contextmanager
def _opened(archive: Path) -> Iterator[zipfile.ZipFile]:
    try:
        with zipfile.ZipFile(archive) as members:
            yield members
    except _BROKEN as error:
        raise InputError(f"not a readable archive ({error})", file=archive) from None
