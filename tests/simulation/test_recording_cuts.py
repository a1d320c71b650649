"""A recording that was cut off opens up to there: wherever the power went, whoever was killed."""

from __future__ import annotations

import dataclasses
import itertools
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode
from mcap.reader import NonSeekingReader, make_reader
from mcap_protobuf.decoder import DecoderFactory

from alight import Outcome, Recording
from alight.files import FileError
from alight.simulation.mcap_messages import Samples
from alight.simulation.mcap_reader import HEAD, MAGIC
from alight.simulation.mcap_writer import RecordingWriter
from alight.simulation.recording_description import Description
from alight.simulation.recording_events import Event, EventKind
from tests.recordings import assert_same, each_format, small

EVENTS = (
    Event(0, 0.0, EventKind.START, "start, by a test", 1),
    Event(3, 1.5e-3, EventKind.GAINS, "α = 2", 2, "own", (1.0, 0.1), {"law.gains.alpha": [2.0]}),
    Event(5, 2.5e-3, EventKind.TRIP, "a signal left its limits", values=(202.0,)),
)
PORTIONS = (0, 3, 4, 12, 20)


def eventful(n: int = 20) -> Recording:
    return small(n, events=EVENTS, bench={"dt": 5e-4, "laws": ["own", "other"]})


@pytest.fixture(scope="module")
def recorded(tmp_path_factory) -> Path:
    """A file as the live bench writes it: portions of rows, each safe on the disk, then an end."""
    path = tmp_path_factory.mktemp("recorded") / "run.mcap"
    recording = eventful()
    numbers = np.column_stack([recording.t, recording.samples])
    begun = Description(
        None, recording.layout, recording.verdict, recording.scenario, recording.bench
    )
    with path.open("wb") as file:
        writer = RecordingWriter(file, begun.names)
        writer.describe(begun.as_json())
        writer.flush()
        for first, last in itertools.pairwise(PORTIONS):
            for event in EVENTS:
                if first <= event.row < last:
                    writer.event(event)
            writer.samples(numbers[first:last], first)
            writer.flush()
        writer.describe(dataclasses.replace(begun, samples=len(recording)).as_json())
        writer.finish()
    return path


def records(content: bytes) -> list[tuple[int, int, int]]:
    """Opcode, first byte and last byte of each record."""
    found, at = [], len(MAGIC)
    while at < len(content) - len(MAGIC):
        opcode, length = HEAD.unpack_from(content, at)
        found.append((opcode, at, at + HEAD.size + length))
        at = found[-1][2]
    return found


def test_the_whole_file_loads_to_the_bit(recorded):
    assert_same(Recording.load(recorded), eventful())


def test_wherever_it_is_cut_it_holds_every_row_that_was_safe(recorded, tmp_path):
    content, cut, whole = recorded.read_bytes(), tmp_path / "cut.mcap", eventful()
    found = records(content)
    described = next(end for opcode, _, end in found if opcode == Opcode.METADATA)
    complete = [end for opcode, _, end in found if opcode == Opcode.METADATA][1]
    chunks = [end for opcode, _, end in found if opcode == Opcode.CHUNK]
    assert len(chunks) == len(PORTIONS) - 1
    edges = {at + i for _, *ends in found for at in ends for i in range(-8, 9)}
    for length in sorted({*range(0, len(content), 23), *edges} & {*range(len(content) + 1)}):
        cut.write_bytes(content[:length])
        if length < described:
            with pytest.raises(FileError, match="is damaged, or is not an MCAP file"):
                Recording.load(cut)
            continue
        loaded = Recording.load(cut)
        rows = PORTIONS[sum(length >= end for end in chunks)]
        assert len(loaded) == rows
        assert loaded.t.tobytes() == whole.t[:rows].tobytes()
        assert loaded.samples.tobytes() == whole.samples[:rows].tobytes()
        assert loaded.events == tuple(event for event in EVENTS if event.row < rows)
        if length >= complete:
            assert_same(loaded, whole)
        else:
            assert loaded.verdict.outcome is Outcome.CUT_OFF
            assert loaded.verdict.time == (whole.t[rows - 1] if rows else 0.0)
            assert str(length) in str(loaded.verdict)


@pytest.mark.parametrize("tail", [bytes(1), bytes(5000), b"\xff" * 100, b"\x06" + bytes(200)])
def test_what_a_power_cut_leaves_behind_the_last_row_does_no_harm(recorded, tmp_path, tail):
    """File systems may show a length whose bytes never reached the disk."""
    content, cut = recorded.read_bytes(), tmp_path / "cut.mcap"
    ends = [end for opcode, _, end in records(content) if opcode == Opcode.MESSAGE_INDEX]
    cut.write_bytes(content[: ends[-1]] + tail)
    loaded = Recording.load(cut)
    assert loaded.samples.tobytes() == eventful().samples.tobytes()
    assert loaded.verdict.outcome is Outcome.CUT_OFF


@given(st.data())
def test_a_bit_that_flips_in_a_cut_file_never_changes_a_number(recorded, tmp_path_factory, data):
    content = bytearray(recorded.read_bytes())
    chunks = [(at, end) for opcode, at, end in records(bytes(content)) if opcode == Opcode.CHUNK]
    end = data.draw(st.integers(chunks[-1][1], len(content) - 1))
    at = data.draw(st.integers(chunks[0][0], end - 1))
    content[at] ^= 1 << data.draw(st.integers(0, 7))
    cut = tmp_path_factory.mktemp("flipped") / "cut.mcap"
    cut.write_bytes(content[:end])
    try:
        loaded = Recording.load(cut)
    except FileError:
        return
    whole, rows = eventful(), len(loaded)
    assert rows in PORTIONS
    assert loaded.samples.tobytes() == whole.samples[:rows].tobytes()
    assert loaded.t.tobytes() == whole.t[:rows].tobytes()


def test_a_finished_file_with_a_damaged_byte_anywhere_before_its_index_is_refused(
    recorded, tmp_path
):
    content, damaged = recorded.read_bytes(), tmp_path / "damaged.mcap"
    (end,) = (at for opcode, at, _ in records(content) if opcode == Opcode.DATA_END)
    for at in range(0, end, 7):
        changed = bytearray(content)
        changed[at] ^= 0x10
        damaged.write_bytes(changed)
        with pytest.raises(FileError):
            Recording.load(damaged)


def test_the_mcap_library_streams_a_cut_file(recorded, tmp_path):
    content, cut = recorded.read_bytes(), tmp_path / "cut.mcap"
    chunks = [at for opcode, at, _ in records(content) if opcode == Opcode.CHUNK]
    cut.write_bytes(content[: chunks[-1] + 100])
    found = []
    with cut.open("rb") as file, pytest.raises((EndOfFile, ValueError)):
        reader = NonSeekingReader(file, decoder_factories=[DecoderFactory()])
        for message in reader.iter_decoded_messages("/recording", log_time_order=False):
            found.append(message.decoded_message.F_m)
    assert found == eventful()["F_m"][: PORTIONS[-2]].tolist()


def test_viewers_find_the_events_as_json_with_a_schema(recorded):
    with recorded.open("rb") as file:
        found = list(make_reader(file).iter_messages("/events"))
    assert [json.loads(message.data) for _, _, message in found] == [
        {**event.as_dict(), "values": list(event.values)} for event in EVENTS
    ]
    schema, channel, message = found[1]
    assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
    assert set(json.loads(message.data)) == set(json.loads(schema.data)["properties"])
    assert message.log_time == 1_500_000


@each_format
def test_events_and_bench_survive_both_formats(tmp_path, suffix):
    path = tmp_path / f"run.{suffix}"
    eventful().save(path)
    assert_same(Recording.load(path), eventful())


@pytest.mark.parametrize("suffix", ["parquet", "mcap"])
def test_a_cut_recording_saved_anew_stays_what_it_is(recorded, tmp_path, suffix):
    cut, again = tmp_path / "cut.mcap", tmp_path / f"again.{suffix}"
    cut.write_bytes(recorded.read_bytes()[:-400])
    loaded = Recording.load(cut)
    loaded.save(again)
    assert_same(Recording.load(again), loaded)


def test_the_last_part_of_a_run_keeps_its_events():
    part = eventful().last(7.5e-3)
    assert 1.5e-3 < part.t[0] <= 2.5e-3
    assert part.events == EVENTS[2:]


# The encoding


@given(
    st.lists(st.text(max_size=4), min_size=1, max_size=40, unique=True),
    st.integers(0, 5),
    st.integers(0, 2**32 - 1),
)
def test_a_block_is_encoded_as_protobuf_encodes_its_messages(names, count, seed):
    """Whatever bits the doubles have, those of NaN included."""
    rng = np.random.default_rng(seed)
    rows = rng.integers(0, 2**64, (count, len(names)), dtype=np.uint64).view(np.float64)
    samples = Samples(names)
    message = samples.message_class()
    expected = [
        message(**dict(zip(samples.fields, row.tolist(), strict=True))).SerializeToString()
        for row in rows
    ]
    encoded = samples.encode(rows)
    assert [one.tobytes() for one in encoded] == expected
    decoded = np.empty_like(rows)
    samples.decode(encoded, decoded)
    assert decoded.tobytes() == rows.tobytes()
    assert samples.are_ours(encoded).all()


@pytest.mark.parametrize("width", [15, 16, 2047, 2048])
def test_tags_of_every_length_are_those_of_protobuf(width):
    samples = Samples([f"c{i}" for i in range(width)])
    row = np.arange(float(width))[None]
    message = samples.message_class()()
    message.ParseFromString(samples.encode(row).tobytes())
    assert [value for _, value in message.ListFields()] == row[0].tolist()
    assert message.SerializeToString() == samples.encode(row).tobytes()
