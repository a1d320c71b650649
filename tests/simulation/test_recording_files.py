"""Recordings survive their files to the bit, and other programs read them."""

from __future__ import annotations

import dataclasses
import json
import os
import re
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

from alight import Outcome, Recording, Verdict, simulate
from alight.simulation.mcap_file import field_names
from alight.symbolic.signals import Layout, Signal
from tests.recordings import assert_same, each_format, small

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
def test_every_kind_of_nan_in_one_column_survives(suffix):
    patterns = [0x7FF8 << 48, (0x7FF8 << 48) + 1, 0xFFF8 << 48, 0x7FF4 << 48, 0x7FF0 << 48]
    column = np.tile(np.array(patterns, dtype=np.uint64).view(float), 40)
    layout = Layout({"q": Signal("rad", "angle")})
    recording = small(t=np.arange(200) * 5e-4, samples=column[:, None], layout=layout)
    assert_survives(recording, suffix)


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


def test_the_file_libraries_are_imported_only_when_a_file_is_used():
    script = """
import sys, alight
from alight.simulation import recording_files
alight.Recording.save
print(sorted({"pyarrow", "mcap", "mcap_protobuf", "google.protobuf"} & set(sys.modules)))
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.stdout == "[]\n", done.stderr
