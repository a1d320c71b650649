"""What cannot be saved or loaded is refused, and nothing half-written stays."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from alight import AlightError, Recording
from alight.files import FileError
from alight.symbolic.signals import Layout, Signal
from tests.recordings import FORMATS, each_format, small


@pytest.mark.parametrize("name", ["run.csv", "run", "run.parquet.gz", ".mcap"])
def test_another_suffix_is_refused_with_the_right_ones(tmp_path, name):
    for use in (small().save, Recording.load):
        with pytest.raises(FileError, match=r"suffix.*\.parquet or \.mcap"):
            use(tmp_path / name)
    assert os.listdir(tmp_path) == []


SAVE_WITHOUT_ROOM = """
import os, resource, sys
import numpy as np
from alight import AlightError, Outcome, Recording, Verdict
from alight.symbolic.signals import Layout, Signal

folder, suffix, limited = sys.argv[1], sys.argv[2], sys.argv[3] == "limited"
samples = np.random.default_rng(0).standard_normal((5000, 10))
big = Recording(np.arange(5000) * 5e-4, samples, Layout({"q": Signal("rad", "angle", 10)}),
                Verdict(Outcome.COMPLETED, 2.5))
path = os.path.join(folder, "run." + suffix)
big.last(0.01).save(path)
old = open(path, "rb").read()
if limited:
    resource.setrlimit(resource.RLIMIT_FSIZE, (65536, 65536))
try:
    big.save(path)
except AlightError as error:
    print(error)
    print(os.listdir(folder) == [os.path.basename(path)], open(path, "rb").read() == old)
"""


def save_without_room(folder: Path, suffix: str, how: str, prefix: tuple[str, ...] = ()) -> None:
    command = [*prefix, sys.executable, "-c", SAVE_WITHOUT_ROOM, str(folder), suffix, how]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    complaint, kept = done.stdout.splitlines()
    assert complaint.startswith(f"{folder / f'run.{suffix}'}: cannot be written: ")
    assert ("No space left on device" if how == "full" else "File too large") in complaint
    assert kept == "True True"


@each_format
def test_beyond_the_allowed_size_the_old_recording_stays_alone(tmp_path, suffix):
    save_without_room(tmp_path, suffix, "limited")


@each_format
def test_on_a_full_disk_the_old_recording_stays_alone(tmp_path, suffix):
    """A real file system of 128 KiB, in a mount namespace of its own."""
    mounted = (
        "unshare",
        "-rm",
        "sh",
        "-c",
        f'mount -t tmpfs -o size=128k none {tmp_path} && "$@"',
        "sh",
    )
    if shutil.which("unshare") is None or subprocess.run([*mounted, "true"]).returncode:
        pytest.skip("this machine lets nobody mount a small file system")
    save_without_room(tmp_path, suffix, "full", mounted)


@each_format
def test_a_missing_folder_is_named(tmp_path, suffix):
    with pytest.raises(FileError, match=f"there is no folder {tmp_path / 'none'}"):
        small().save(tmp_path / "none" / f"run.{suffix}")


@each_format
@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"layout": Layout({"t": Signal("s", ""), "q": Signal("", "", 2)})}, "one column t;"),
        ({"layout": Layout({"q": Signal("", "", 2), "q2": Signal("", "")})}, "one column q2;"),
        ({"layout": Layout({"q": Signal("", "", 2)})}, r"\(4, 3\).*\(4, 2\)"),
        ({"t": np.zeros(5)}, r"\(4, 3\).*\(5, 3\)"),
        ({"scenario": {"law": {"table": {1, 2}}}}, r"holds \{1, 2\}"),
    ],
)
def test_what_is_no_recording_is_refused_before_a_file_is_made(
    tmp_path, suffix, changes, complaint
):
    with pytest.raises(AlightError, match=complaint):
        small(**changes).save(tmp_path / f"run.{suffix}")
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("time", [-1e-9, np.nan, np.inf, 1e10])
def test_mcap_has_no_room_for_such_times(tmp_path, time):
    with pytest.raises(AlightError, match="no times before 0"):
        small(t=np.array([0.0, 1.0, 2.0, time])).save(tmp_path / "run.mcap")
    assert os.listdir(tmp_path) == []


def test_numpy_numbers_in_a_scenario_become_plain_ones(tmp_path):
    given = {"n": np.int64(3), "gains": np.array([1.5, 2.5]), "on": np.bool_(True)}
    small(scenario=given).save(tmp_path / "run.parquet")
    loaded = Recording.load(tmp_path / "run.parquet")
    assert loaded.scenario == {"n": 3, "gains": [1.5, 2.5], "on": True}


def assert_refused(path: Path, complaint: str) -> None:
    with pytest.raises(FileError, match=complaint) as caught:
        Recording.load(path)
    assert caught.value.path == path


def test_a_parquet_file_that_was_cut_anywhere_is_refused(tmp_path):
    """One of MCAP opens up to there: see test_recording_cuts."""
    whole, cut = tmp_path / "whole.parquet", tmp_path / "cut.parquet"
    small(2).save(whole)
    content = whole.read_bytes()
    for length in {*range(0, len(content), 29), *range(len(content) - 20, len(content))}:
        cut.write_bytes(content[:length])
        assert_refused(cut, "is damaged, or is not")


@each_format
def test_damaged_numbers_are_noticed(tmp_path, suffix):
    """A bit that flips on the disk never changes a number silently."""
    path = tmp_path / f"run.{suffix}"
    recording = small(400)
    recording.save(path)
    content = path.read_bytes()
    refused = 0
    for at in np.random.default_rng(0).integers(0, len(content), 300):
        damaged = bytearray(content)
        damaged[at] ^= 0x10
        path.write_bytes(damaged)
        try:
            loaded = Recording.load(path)
        except FileError:
            refused += 1
        else:
            assert loaded.samples.tobytes() == recording.samples.tobytes()
            assert loaded.t.tobytes() == recording.t.tobytes()
    assert refused > 150


@each_format
@pytest.mark.parametrize("content", [b"", b"PAR1", b"t,q1\n0.0,1.0\n", bytes(1000)])
def test_a_file_of_another_kind_is_refused(tmp_path, suffix, content):
    path = tmp_path / f"run.{suffix}"
    path.write_bytes(content)
    assert_refused(path, "is damaged, or is not a.? (Parquet|MCAP) file")


@each_format
def test_the_other_format_under_this_name_is_refused(tmp_path, suffix):
    other = next(f for f in FORMATS if f != suffix)
    small().save(tmp_path / f"run.{other}")
    path = (tmp_path / f"run.{other}").rename(tmp_path / f"run.{suffix}")
    assert_refused(path, "is damaged, or is not")


@each_format
def test_a_missing_file_and_a_folder_are_refused(tmp_path, suffix):
    assert_refused(tmp_path / f"none.{suffix}", "cannot be read: No such file")
    (tmp_path / f"folder.{suffix}").mkdir()
    assert_refused(tmp_path / f"folder.{suffix}", "cannot be read: Is a directory")


def test_parquet_of_somebody_else_is_refused(tmp_path):
    path = tmp_path / "run.parquet"
    pd.DataFrame({"t": [0.0], "q1": [1.0]}).to_parquet(path)
    assert_refused(path, "is no recording: its metadata has no entry 'alight'")


def test_mcap_of_somebody_else_is_refused(tmp_path):
    from mcap.writer import Writer

    path = tmp_path / "run.mcap"
    writer = Writer(str(path))
    writer.start()
    writer.finish()
    assert_refused(path, "is no recording: it has no metadata record 'alight'")


def rewritten(path: Path, description: object = None, drop: str = "", first: int = 0) -> Path:
    """A Parquet file whose description or columns somebody changed."""
    table = pq.read_table(path)
    if description is not None:
        table = table.replace_schema_metadata({"alight": json.dumps(description)})
    table = table.drop_columns([drop]) if drop else table
    pq.write_table(table.slice(first), path)
    return path


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"format": 2, "version": "9.0"}, "in format 2 by Alight 9.0; this is Alight"),
        ({"format": "x"}, "in format x by"),
        ({"verdict": {"outcome": "LOST", "time": 0, "signal": None, "cause": None}}, "LOST"),
        ({"verdict": None}, "verdict"),
        ({"layout": {"q": {"unit": "rad"}}}, "layout.q.meaning: missing"),
        ({"samples": "many"}, "samples = 'many'"),
    ],
)
def test_a_strange_description_is_refused_and_the_field_named(tmp_path, change, complaint):
    path = tmp_path / "run.parquet"
    small().save(path)
    description = json.loads(pq.read_schema(path).metadata[b"alight"])
    assert_refused(rewritten(path, description | change), complaint)


@pytest.mark.parametrize("description", [[], 3, "text", None])
def test_a_description_that_is_no_table_is_refused(tmp_path, description):
    path = tmp_path / "run.parquet"
    small().save(path)
    table = pq.read_table(path).replace_schema_metadata({"alight": json.dumps(description)})
    pq.write_table(table, path)
    assert_refused(path, "description of the recording is wrong")


def test_missing_columns_and_samples_are_noticed(tmp_path):
    path = tmp_path / "run.parquet"
    small().save(path)
    assert_refused(rewritten(path, first=1), "holds 3 samples of 4 columns where .* 4 of 4")
    small().save(path)
    assert_refused(rewritten(path, drop="q2"), r"columns are .*, not .*q2 \(double\)")
