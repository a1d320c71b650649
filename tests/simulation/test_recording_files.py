"""Recordings survive their files to the bit, other programs read them, errors name the file."""

from __future__ import annotations

import dataclasses
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
import polars as pl
import pyarrow.parquet as pq
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from alight import AlightError, Outcome, Recording, Verdict, simulate
from alight.files import FileError
from alight.simulation.mcap_file import field_names
from alight.symbolic.signals import Layout, Signal

FORMATS = ("parquet", "mcap")
each_format = pytest.mark.parametrize("suffix", FORMATS)

ODD = [np.nan, np.inf, -np.inf, -0.0, 0.0, 5e-324, 1.7976931348623157e308]
bits = st.integers(0, 2**64 - 1).map(lambda i: float(np.uint64(i).view(np.float64)))
numbers = st.sampled_from(ODD) | st.floats() | bits
texts = st.text(max_size=8)
plain = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | texts,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(texts, inner, max_size=3),
    max_leaves=8,
)


def signals() -> st.SearchStrategy[Signal]:
    return st.builds(Signal, unit=texts, meaning=texts, size=st.integers(1, 3))


def layouts() -> st.SearchStrategy[Layout]:
    def unambiguous(layout: Layout) -> bool:
        return len({"t", *layout.columns}) == 1 + layout.size

    names = st.sampled_from(["q", "e_r", "Λ", "e.m", "1", "", "a b", "a_b", "aB", "Clear"]) | texts
    return st.dictionaries(names, signals(), max_size=5).map(Layout).filter(unambiguous)


def verdicts() -> st.SearchStrategy[Verdict]:
    maybe = st.none() | texts
    finite = st.floats(allow_nan=False)
    return st.builds(Verdict, st.sampled_from(Outcome), finite, maybe, maybe)


@st.composite
def recordings(draw: st.DrawFn, times: st.SearchStrategy[float] = numbers) -> Recording:
    layout, length = draw(layouts()), draw(st.integers(0, 6))
    t = draw(st.lists(times, min_size=length, max_size=length))
    count = length * layout.size
    samples = draw(st.lists(numbers, min_size=count, max_size=count))
    return Recording(
        np.array(t, dtype=float),
        np.array(samples, dtype=float).reshape(length, layout.size),
        layout,
        draw(verdicts()),
        draw(st.dictionaries(texts, plain, max_size=3)),
    )


def small(n: int = 4, **changes) -> Recording:
    layout = Layout({"q": Signal("rad", "joint angles", 2), "F_m": Signal("N", "impact force")})
    rng = np.random.default_rng(1)
    made = Recording(
        t=np.arange(n) * 5e-4,
        samples=rng.standard_normal((n, 3)),
        layout=layout,
        verdict=Verdict(Outcome.DIVERGED, 1.5e-3, "q1", "gains"),
        scenario={"duration": 1.0, "plant": {"K_I": 1e5}},
    )
    return dataclasses.replace(made, **changes)


def assert_same(loaded: Recording, saved: Recording) -> None:
    assert loaded.t.tobytes() == saved.t.tobytes()
    assert loaded.samples.shape == saved.samples.shape
    assert loaded.samples.tobytes() == saved.samples.tobytes()
    assert loaded.layout == saved.layout
    assert list(loaded.layout.signals) == list(saved.layout.signals)
    assert loaded.verdict == saved.verdict
    assert loaded.scenario == saved.scenario


def assert_survives(recording: Recording, suffix: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f"run.{suffix}")
        recording.save(path)
        assert_same(Recording.load(path), recording)
        assert os.listdir(folder) == [path.name]


@pytest.fixture(scope="module")
def run() -> Recording:
    return simulate("experiment-1", backend="vm")


@given(recordings())
def test_parquet_keeps_every_bit(recording):
    assert_survives(recording, "parquet")


@given(recordings(times=st.floats(0, 1e9)))
def test_mcap_keeps_every_bit(recording):
    assert_survives(recording, "mcap")


@each_format
def test_a_real_run_survives(run, suffix):
    assert_survives(run, suffix)


@each_format
def test_the_part_of_a_run_survives(run, suffix):
    """Its arrays are views into the whole run and start late."""
    assert_survives(run.last(0.1), suffix)


def test_pandas_and_polars_read_the_columns(run, tmp_path):
    path = tmp_path / "run.parquet"
    run.save(path)
    by_pandas, by_polars = pd.read_parquet(path), pl.read_parquet(path)
    names = ["t", *run.columns]
    assert list(by_pandas.columns) == by_polars.columns == names
    assert (by_pandas.dtypes == np.float64).all()
    assert set(by_polars.dtypes) == {pl.Float64}
    for name in names:
        expected = (run.t if name == "t" else run[name]).tobytes()
        assert by_pandas[name].to_numpy().tobytes() == expected
        assert by_polars[name].to_numpy().tobytes() == expected


def test_parquet_states_units_verdict_and_scenario(run, tmp_path):
    path = tmp_path / "run.parquet"
    run.save(path)
    schema = pq.read_schema(path)
    assert schema.field("t").metadata[b"unit"] == b"s"
    for name, signal in run.layout.signals.items():
        column = name if signal.size == 1 else f"{name}1"
        assert schema.field(column).metadata[b"unit"].decode() == signal.unit
        assert schema.field(column).metadata[b"meaning"].decode() == signal.meaning
    assert_describes(json.loads(schema.metadata[b"alight"]), run)
    chunk = pq.read_metadata(path).row_group(0).column(0)
    assert chunk.compression == "ZSTD"


def assert_describes(description: dict, recording: Recording) -> None:
    assert description["scenario"] == recording.scenario
    assert description["verdict"]["outcome"] == recording.verdict.outcome.name
    assert description["verdict"]["time"] == recording.verdict.time
    assert description["layout"]["F_m"]["unit"] == "N"
    assert list(description["layout"]) == list(recording.layout.signals)


def test_the_mcap_library_reads_the_messages(run, tmp_path):
    part = dataclasses.replace(run, t=run.t[:3000], samples=run.samples[:3000])
    path = tmp_path / "run.mcap"
    part.save(path)
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        (metadata,) = reader.iter_metadata()
        found = list(reader.iter_decoded_messages("/recording"))
    assert summary.statistics.message_count == len(part)
    assert {chunk.compression for chunk in summary.chunk_indexes} == {"zstd"}
    assert_describes(json.loads(metadata.metadata["json"]), part)
    assert [m.message.log_time for m in found] == [i * 500_000 for i in range(len(part))]
    for name in ("t", *part.columns):
        expected = part.t if name == "t" else part[name]
        assert np.array([getattr(m.decoded_message, name) for m in found]).tobytes() == (
            expected.tobytes()
        )


IDENTIFIER = r"[A-Za-z_][A-Za-z0-9_]*"


@given(st.lists(texts | st.from_regex(IDENTIFIER, fullmatch=True), unique=True, max_size=6))
@example(["a b", "a_b", "a_b_", "1", "_1", ""])
def test_protobuf_names_are_valid_and_distinct(columns):
    names = field_names(columns)
    assert len(set(names)) == len(names) == len(columns)
    assert all(re.fullmatch(IDENTIFIER, name) for name in names)


@given(st.lists(st.from_regex(IDENTIFIER, fullmatch=True), unique=True, max_size=6))
def test_names_that_protobuf_accepts_are_kept(columns):
    assert field_names(columns) == columns


@each_format
def test_saving_again_replaces_the_old_recording(tmp_path, suffix):
    path = tmp_path / f"run.{suffix}"
    small(50).save(path)
    small(3).save(path)
    assert_same(Recording.load(path), small(3))


def test_the_suffix_may_be_in_capitals(tmp_path):
    small().save(tmp_path / "RUN.MCAP")
    assert_same(Recording.load(tmp_path / "RUN.MCAP"), small())


@pytest.mark.parametrize("name", ["run.csv", "run", "run.parquet.gz", ".mcap"])
def test_another_suffix_is_refused_with_the_right_ones(tmp_path, name):
    for use in (small().save, Recording.load):
        with pytest.raises(FileError, match=r"suffix.*\.parquet or \.mcap"):
            use(tmp_path / name)
    assert os.listdir(tmp_path) == []


# --- what cannot be saved -------------------------------------------------------------------

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


# --- what cannot be loaded ------------------------------------------------------------------


def assert_refused(path: Path, complaint: str) -> None:
    with pytest.raises(FileError, match=complaint) as caught:
        Recording.load(path)
    assert caught.value.path == path


@each_format
def test_a_file_that_was_cut_anywhere_is_refused(tmp_path, suffix):
    whole, cut = tmp_path / f"whole.{suffix}", tmp_path / f"cut.{suffix}"
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


def test_the_file_libraries_are_imported_only_when_a_file_is_used():
    script = """
import sys, alight
from alight.simulation import recording_files
alight.Recording.save
print(sorted({"pyarrow", "mcap", "mcap_protobuf", "google.protobuf"} & set(sys.modules)))
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.stdout == "[]\n", done.stderr
