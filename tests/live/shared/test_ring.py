"""A telemetry ring delivers whole rows in their order, whatever writer and reader do."""

from __future__ import annotations

import signal
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from alight.files import FileError
from alight.live.shared.ring import UNSURE, TelemetryRing
from tests.cli.command import environment
from tests.live.bench import wait_for

WIDTH, CAPACITY = 67, 16
WRITER = """
import sys
from pathlib import Path
from alight.live.shared.ring import TelemetryRing
ring = TelemetryRing.open(Path(sys.argv[1]))
number = 0
while True:
    ring.slot[:] = number
    ring.publish()
    number += 1
"""


def publish(ring: TelemetryRing, count: int) -> None:
    for _ in range(count):
        ring.slot[:] = ring.head
        ring.publish()


@given(
    capacity=st.integers(3, 20),
    steps=st.lists(
        st.tuples(st.integers(0, 30), st.integers(0, 60), st.integers(0, 25)), max_size=8
    ),
)
def test_a_reader_gets_each_row_that_is_kept_once_and_in_order(tmp_path_factory, capacity, steps):
    path = tmp_path_factory.mktemp("ring") / "ring"
    writer = TelemetryRing.create(path, 2, capacity)
    reader = TelemetryRing.open(path)
    for count, asked, most in steps:
        publish(writer, count)
        first, rows = reader.read(asked, most)
        oldest = max(reader.head - capacity + UNSURE, 0)
        assert first == max(asked, oldest)
        np.testing.assert_array_equal(rows[:, 0], np.arange(first, first + len(rows)))
        assert len(rows) == max(min(most, reader.head - first), 0)
    assert reader.head == sum(count for count, _, _ in steps)


@pytest.mark.parametrize("pause", [False, True])
def test_no_row_is_ever_torn_or_out_of_place_while_another_process_writes(tmp_path, pause):
    """The ring is so short that the writer overtakes the reader again and again."""
    ring = TelemetryRing.create(tmp_path / "ring", WIDTH, CAPACITY)
    command = [sys.executable, "-c", WRITER, str(tmp_path / "ring")]
    writer = subprocess.Popen(command, env=environment())
    lost = seen = following = 0
    try:
        wait_for(lambda: ring.head > 0)
        while seen < 100_000 or lost < 1000:
            first, rows = ring.read(following if pause else max(ring.head - 3, 0))
            expected = np.arange(first, first + len(rows))[:, None]
            assert (rows == expected).all()
            lost += pause * (first - following) + (not pause)
            seen += len(rows)
            following = first + len(rows)
    finally:
        writer.kill()
        writer.wait()


def test_a_writer_that_dies_leaves_whole_rows(tmp_path):
    ring = TelemetryRing.create(tmp_path / "ring", WIDTH, CAPACITY)
    command = [sys.executable, "-c", WRITER, str(tmp_path / "ring")]
    writer = subprocess.Popen(command, env=environment())
    wait_for(lambda: ring.head > 1000)
    writer.send_signal(signal.SIGKILL)
    writer.wait()
    first, rows = ring.read(0)
    assert len(rows) == CAPACITY - UNSURE and first + len(rows) == ring.head
    np.testing.assert_array_equal(rows, np.arange(first, ring.head)[:, None] * np.ones(WIDTH))


def test_the_file_may_go_while_it_is_in_use(tmp_path):
    writer = TelemetryRing.create(tmp_path / "ring", 2, 8)
    reader = TelemetryRing.open(tmp_path / "ring")
    (tmp_path / "ring").unlink()
    publish(writer, 3)
    np.testing.assert_array_equal(reader.read(0)[1][:, 1], [0, 1, 2])


@pytest.mark.parametrize("content", [b"", b"x" * 12, bytes(8 * 8), bytes(8 * 100), None])
def test_what_is_no_ring_is_refused(tmp_path, content):
    path = tmp_path / "ring"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(FileError, match="ring"):
        TelemetryRing.open(path)


def test_a_ring_without_room_for_it_is_refused(tmp_path):
    with pytest.raises(FileError, match="cannot be shared"):
        TelemetryRing.create(tmp_path / "missing" / "ring", 2, 8)
