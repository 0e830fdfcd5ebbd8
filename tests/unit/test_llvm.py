"""Discovery of libLLVM among fake library files; no library is loaded unless its name is silent."""

import os
from pathlib import Path

import pytest

from vlnhijack import llvm
from vlnhijack.errors import SetupError


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The only folder that is searched."""
    monkeypatch.setenv(llvm.VARIABLE, "")
    monkeypatch.delenv("CONDA_PREFIX", raising=False)
    monkeypatch.setattr(llvm, "FOLDERS", (str(tmp_path),))
    monkeypatch.setattr(llvm, "_from_ldconfig", lambda: iter(()))
    return tmp_path


@pytest.mark.parametrize(
    ("path", "version"),
    [
        ("libLLVM-14.0.6.so.1", 14),
        ("libLLVM-15.so.1", 15),
        ("libLLVM.so.19.1", 19),
        ("libLLVM-19.so", 19),
        ("llvm-16/lib/libLLVM.so", 16),
        ("lib64/llvm17/lib/libLLVM.so", 17),
        ("Cellar/llvm/20.1.7/lib/libLLVM.dylib", 20),
        ("opt/llvm@18/lib/libLLVM.dylib", 18),
        ("libLLVM.so", 0),
    ],
)
def test_version_from_the_path(tmp_path: Path, path: str, version: int) -> None:
    file = tmp_path / path
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(b"no library")
    assert llvm.inspect(file).version == version


def test_newest_is_chosen_and_exported(folder: Path) -> None:
    for name in ("libLLVM-14.so", "libLLVM-15.so.1", "libLLVM-18.so", "libLLVM.so.19.1"):
        (folder / name).touch()
    assert llvm.require_llvm() == llvm.Llvm(folder / "libLLVM.so.19.1", 19)
    assert os.environ[llvm.VARIABLE] == str(folder / "libLLVM.so.19.1")


def test_links_and_strangers_are_not_candidates(folder: Path) -> None:
    (folder / "libLLVM.so.19.1").touch()
    (folder / "libLLVM-19.so").symlink_to("libLLVM.so.19.1")
    (folder / "libLLVM-20.so").symlink_to("gone.so")
    (folder / "libLLVMSupport.a").touch()
    assert [path.resolve().name for path in llvm.candidates()] == ["libLLVM.so.19.1"]


def test_only_old_ones_is_an_error_with_the_fix(folder: Path) -> None:
    (folder / "libLLVM-14.so").touch()
    (folder / "libLLVM-15.so").touch()
    with pytest.raises(SetupError, match=r"libLLVM >= 16, found 14, 15; fix: .*install"):
        llvm.require_llvm()
    assert not os.environ[llvm.VARIABLE]


def test_none_is_an_error_with_the_fix(folder: Path) -> None:
    with pytest.raises(SetupError, match="found none; fix: "):
        llvm.require_llvm()


def test_the_users_choice_is_kept(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "libLLVM-19.so").touch()
    chosen = folder / "libLLVM-17.so"
    chosen.touch()
    monkeypatch.setenv(llvm.VARIABLE, str(chosen))
    assert llvm.require_llvm() == llvm.Llvm(chosen, 17)


@pytest.mark.parametrize(
    ("name", "message"), [("libLLVM-14.so", "found 14 at "), ("gone.so", "is no file")]
)
def test_a_bad_choice_is_named(
    folder: Path, monkeypatch: pytest.MonkeyPatch, name: str, message: str
) -> None:
    (folder / "libLLVM-19.so").touch()
    (folder / "libLLVM-14.so").touch()
    monkeypatch.setenv(llvm.VARIABLE, str(folder / name))
    with pytest.raises(SetupError, match=message):
        llvm.require_llvm()


def test_this_machine_has_one() -> None:
    found = llvm.require_llvm()
    assert found.version >= llvm.MINIMUM
    assert llvm._loaded_version(found.path) == found.version
