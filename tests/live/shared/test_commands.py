"""A command arrives whole or not at all, is answered once, and nobody waits for anybody."""

from __future__ import annotations

import signal
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from alight.errors import AlightError
from alight.live.shared.block import open_block
from alight.live.shared.commands import (
    MOST_TEXT,
    MOST_VALUES,
    REASON,
    SLOT,
    SLOTS,
    CommandBox,
    Kind,
    Outcome,
)
from tests.cli.command import environment
from tests.live.bench import wait_for

FINITE = st.floats(allow_nan=False, allow_infinity=False)
SUBMITTER = """
import sys
from pathlib import Path
from alight.errors import AlightError
from alight.live.shared.commands import CommandBox, Kind
box = CommandBox.open(Path(sys.argv[1]))
number = 0
while True:
    try:
        number = box.submit(Kind.PARAMETERS, values=[float(number + 1)] * 200, text="x" * 4000)
    except AlightError:
        pass
"""


@pytest.fixture
def box(tmp_path):
    return CommandBox.create(tmp_path / "commands")


@given(
    commands=st.lists(
        st.tuples(
            st.sampled_from(Kind),
            st.integers(0, 5),
            st.lists(FINITE, max_size=8),
            st.text(
                st.characters(exclude_characters="\x00", exclude_categories=["Cs"]), max_size=20
            ),
        ),
        max_size=6,
    )
)
def test_what_is_submitted_is_taken_in_its_order_and_answered(tmp_path_factory, commands):
    path = tmp_path_factory.mktemp("box") / "commands"
    host, page = CommandBox.create(path), CommandBox.open(path)
    numbers = [page.submit(k, law=law, values=v, text=t) for k, law, v, t in commands]
    assert numbers == list(range(1, len(commands) + 1))
    for number, (kind, law, values, text) in zip(numbers, commands, strict=True):
        assert page.answer(number).outcome is Outcome.PENDING
        taken = host.take()
        assert taken is not None
        assert (taken.number, taken.kind, taken.law) == (number, kind, law)
        np.testing.assert_array_equal(taken.values, values)
        assert (page.text_of(number), page.kind_of(number)) == (text, kind)
        host.reply(number, Outcome.REFUSED if number % 2 else Outcome.APPLIED, 7 * number, text)
        answer = page.answer(number)
        assert answer.outcome is (Outcome.REFUSED if number % 2 else Outcome.APPLIED)
        assert (answer.tick, answer.reason) == (7 * number, text)
    assert host.take() is None and page.done == len(commands)


def test_many_rounds_of_the_box_keep_their_numbers(box):
    for number in range(1, 2 * SLOTS + 10):
        assert box.submit(Kind.KICK, values=[number, 0, 1]) == number
        taken = box.take()
        assert (taken.number, taken.values[0]) == (number, number)
        box.reply(number, Outcome.APPLIED, number)
    assert box.answer(5).outcome is Outcome.PENDING  # no longer kept
    assert box.text_of(5) == "" and box.kind_of(5) is None and box.command(5) is None


@pytest.mark.parametrize("values", [[np.nan], [1.0, np.inf], np.zeros(MOST_VALUES + 1)])
def test_a_page_cannot_submit_what_is_no_number_or_too_long(box, values):
    with pytest.raises(AlightError, match="numbers"):
        box.submit(Kind.PARAMETERS, values=values)
    with pytest.raises(AlightError, match="text"):
        box.submit(Kind.START, text="x" * (MOST_TEXT + 1))
    assert box.submitted == 0


def test_a_host_that_does_not_answer_is_noticed(box):
    with pytest.raises(AlightError, match="has not answered"):
        for _ in range(SLOTS):
            box.submit(Kind.STOP)
    assert box.submitted < SLOTS


@given(at=st.integers(0, SLOT.itemsize - 1), flip=st.integers(1, 255))
def test_a_damaged_command_is_refused_or_what_was_submitted(tmp_path_factory, at, flip):
    """The checksum leaves out the text, which the host does not read, and the answer."""
    path = tmp_path_factory.mktemp("box") / "commands"
    box, block = CommandBox.create(path), open_block(path, SLOT)
    number = box.submit(Kind.KICK, law=0, values=[1.0, 2.0, 3.0])
    slot = block[1:][number % SLOTS : number % SLOTS + 1]
    slot.view(np.uint8)[at] ^= flip
    taken = box.take()
    if taken is None:
        assert box.done == number
        assert slot["outcome"][0] == Outcome.REFUSED
    else:
        assert (taken.number, taken.kind, taken.law) == (number, Kind.KICK, 0)
        np.testing.assert_array_equal(taken.values, [1.0, 2.0, 3.0])


def test_commands_of_a_submitter_at_full_speed_arrive_whole_and_one_killed_leaves_none_half(
    tmp_path,
):
    box = CommandBox.create(tmp_path / "commands")
    command = [sys.executable, "-c", SUBMITTER, str(tmp_path / "commands")]
    submitter = subprocess.Popen(command, env=environment())
    try:
        wait_for(lambda: box.submitted > 0)
        expected = 1
        while expected < 4000:
            if expected == 3000:
                submitter.send_signal(signal.SIGKILL)
                submitter.wait()
            taken = box.take()
            if taken is None and submitter.poll() is not None:
                break
            if taken is not None:
                assert taken.number == expected and (taken.values == expected).all()
                box.reply(expected, Outcome.APPLIED, expected)
                expected += 1
    finally:
        submitter.kill()
        submitter.wait()
    assert box.done == box.submitted >= 2999


def test_a_reason_that_is_too_long_is_cut(box):
    box.submit(Kind.START)
    box.reply(box.take().number, Outcome.REFUSED, 1, "é" * 2 * REASON)
    assert 0 < len(box.answer(1).reason) <= REASON


def test_a_command_whose_submitter_died_in_its_midst_was_never_there(box, tmp_path):
    slot = open_block(tmp_path / "commands", SLOT)[1:][1:2]
    slot["number"], slot["kind"], slot["count"] = 1, Kind.START, 200
    assert box.take() is None and box.done == 0
    assert box.submit(Kind.STOP) == 1
    assert box.take().kind is Kind.STOP
