"""A file appears whole or not at all."""

from __future__ import annotations

import os
import signal
import stat
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from alight import AlightError
from alight.files import FileError, file_to_read, whole_file

OLD = b"the old file"


@contextmanager
def ordinary_user() -> Iterator[None]:
    """Give up the rights of root, whom no permission stops."""
    root = os.geteuid() == 0
    if root:
        os.seteuid(65534)
    try:
        yield
    finally:
        if root:
            os.seteuid(0)


def write(path: Path, content: bytes = b"new") -> None:
    with whole_file(path) as file:
        file.write(content)


@given(content=st.binary(max_size=10_000), old=st.none() | st.binary())
def test_what_is_written_is_read_and_nothing_else_appears(content, old):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.bin")
        if old is not None:
            path.write_bytes(old)
        write(path, content)
        with file_to_read(path, "a file") as file:
            assert file.read() == content
        assert os.listdir(folder) == ["a.bin"]


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError, MemoryError])
@pytest.mark.parametrize("exists", [True, False])
def test_an_error_in_the_middle_leaves_the_folder_as_it_was(tmp_path, error, exists):
    path = tmp_path / "a.bin"
    if exists:
        path.write_bytes(OLD)
    with pytest.raises(error), whole_file(path) as file:
        file.write(b"half of the content")
        raise error
    assert os.listdir(tmp_path) == (["a.bin"] if exists else [])
    assert not exists or path.read_bytes() == OLD


def test_the_old_file_stands_until_the_new_one_is_complete(tmp_path):
    path = tmp_path / "a.bin"
    path.write_bytes(OLD)
    with whole_file(path) as file:
        file.write(b"new")
        file.flush()
        assert path.read_bytes() == OLD
    assert path.read_bytes() == b"new"


def test_ctrl_c_while_writing_leaves_nothing_half_written(tmp_path):
    path = tmp_path / "a.bin"
    path.write_bytes(OLD)
    script = """
import sys, time
from alight.files import whole_file
with whole_file(sys.argv[1]) as file:
    file.write(bytes(100_000))
    file.flush()
    print("writing", flush=True)
    time.sleep(60)
"""
    command = [sys.executable, "-c", script, str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as child:
        assert child.stdout.readline() == b"writing\n"
        assert len(os.listdir(tmp_path)) == 2
        child.send_signal(signal.SIGINT)
        _, complaint = child.communicate(timeout=30)
    assert b"KeyboardInterrupt" in complaint
    assert child.returncode != 0
    assert os.listdir(tmp_path) == ["a.bin"]
    assert path.read_bytes() == OLD


def test_a_folder_that_refuses_new_files_is_named_with_the_reason():
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o555)
        with ordinary_user(), pytest.raises(FileError, match="Permission denied") as caught:
            write(Path(folder, "a.bin"))
        assert str(Path(folder, "a.bin")) in str(caught.value)
        assert os.listdir(folder) == []


def test_a_folder_that_may_not_be_looked_into_is_named_with_the_reason():
    with tempfile.TemporaryDirectory() as folder:
        inner = Path(folder, "inner")
        inner.mkdir()
        os.chmod(folder, 0o000)
        try:
            with ordinary_user(), pytest.raises(FileError, match="Permission denied"):
                write(inner / "a.bin")
        finally:
            os.chmod(folder, 0o700)
        assert os.listdir(inner) == []


def test_a_file_that_is_protected_against_writing_is_kept():
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.bin")
        path.write_bytes(OLD)
        path.chmod(0o444)
        os.chmod(folder, 0o777)
        with ordinary_user(), pytest.raises(FileError, match="Permission denied"):
            write(path)
        assert path.read_bytes() == OLD
        assert os.listdir(folder) == ["a.bin"]


def test_a_missing_folder_is_named_and_not_made(tmp_path):
    with pytest.raises(FileError, match=f"there is no folder {tmp_path / 'none'}") as caught:
        write(tmp_path / "none" / "a.bin")
    assert caught.value.path == tmp_path / "none" / "a.bin"
    assert isinstance(caught.value, AlightError)
    assert os.listdir(tmp_path) == []


def test_a_file_in_the_place_of_a_folder_is_named(tmp_path):
    (tmp_path / "file").write_bytes(OLD)
    with pytest.raises(FileError, match="is not a folder"):
        write(tmp_path / "file" / "a.bin")


def test_folders_and_devices_are_never_replaced(tmp_path):
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe")
    for name in ("folder", "pipe"):
        with pytest.raises(FileError, match="a folder or a device"):
            write(tmp_path / name)
    assert sorted(os.listdir(tmp_path)) == ["folder", "pipe"]
    assert stat.S_ISFIFO(os.stat(tmp_path / "pipe").st_mode)


def test_a_name_that_is_too_long_is_refused(tmp_path):
    with pytest.raises(FileError, match="File name too long"):
        write(tmp_path / ("a" * 300))
    assert os.listdir(tmp_path) == []


def test_a_link_stays_a_link_and_its_target_gets_the_content(tmp_path):
    (tmp_path / "real").mkdir()
    target, link = tmp_path / "real" / "a.bin", tmp_path / "link.bin"
    target.write_bytes(OLD)
    link.symlink_to(target)
    write(link)
    assert link.is_symlink()
    assert target.read_bytes() == b"new"
    assert os.listdir(tmp_path / "real") == ["a.bin"]


@pytest.mark.parametrize("mode", [0o600, 0o664])
def test_permissions_of_the_old_file_are_kept(tmp_path, mode):
    path = tmp_path / "a.bin"
    path.write_bytes(OLD)
    path.chmod(mode)
    write(path)
    assert stat.S_IMODE(path.stat().st_mode) == mode


def test_a_new_file_gets_the_permissions_of_any_new_file(tmp_path):
    (tmp_path / "usual").write_bytes(b"")
    write(tmp_path / "a.bin")
    assert (tmp_path / "a.bin").stat().st_mode == (tmp_path / "usual").stat().st_mode


def test_reading_says_which_file_and_what_is_wrong(tmp_path):
    (tmp_path / "a.bin").write_bytes(b"abc")
    with (
        pytest.raises(FileError, match="cannot be read: No such file"),
        file_to_read(tmp_path / "none", "a file"),
    ):
        pass
    with (
        pytest.raises(FileError, match="cannot be read: Is a directory"),
        file_to_read(tmp_path, "a file"),
    ):
        pass
    with (
        pytest.raises(FileError, match=r"a\.bin: is damaged, or is not a number: .*'abc'"),
        file_to_read(tmp_path / "a.bin", "a number") as file,
    ):
        int(file.read())
