"""The host as a process: runs on its own clock, takes commands between two ticks, dies alone."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import alight
from alight.live.bank import Bank, parameter_column
from alight.live.cycle import DEADLINES
from alight.live.session import Link
from alight.live.shared.commands import Kind, Outcome
from alight.live.shared.status import State
from tests.cli.command import OWN_ARM, environment
from tests.live.bench import (
    Bench,
    ask,
    bench,
    columns,
    gather,
    lives,
    state_of,
    wait_for,
    with_value,
)

SLOW_RATE = ("testbed.sample_rate=500.0",)
"""A tick in two milliseconds: for a machine that runs other tests as well."""


@pytest.fixture(scope="module")
def hosted(tmp_path_factory):
    with bench(tmp_path_factory.mktemp("host")) as made:
        yield made


@pytest.fixture
def link(hosted: Bench) -> Link:
    """A host that is ready, as if it had just begun."""
    found = hosted.link()
    ask(found, Kind.STOP)
    assert ask(found, Kind.RESET).outcome is Outcome.APPLIED
    first = Bank.of(hosted.session.scenario).loops[0]
    assert ask(found, Kind.LAW, values=parameter_column(first)).outcome is Outcome.APPLIED
    return found


def test_a_run_is_the_simulation_to_the_last_bit_and_no_row_is_missing(hosted, link):
    begun = ask(link, Kind.START)
    assert begun.outcome is Outcome.APPLIED
    count = 1500
    rows = gather(link, begun.tick, count)
    scenario = alight.load_scenario("experiment-1")
    recorded = alight.simulate(scenario, backend="auto")
    shared = [n for n in recorded.layout.signals if n in link.layout.signals]
    assert {"q", "tau", "tau_applied", "theta_r_hat", "F_m"} <= set(shared)
    np.testing.assert_array_equal(rows[:, columns(link, "t")].ravel(), recorded.t[:count])
    for name in shared:
        mine = rows[:, columns(link, name)].squeeze()
        np.testing.assert_array_equal(mine, recorded[name][:count].squeeze(), err_msg=name)


def test_telemetry_flows_before_a_run_and_torque_does_not(link):
    rows = gather(link, link.ring.head, 100)
    assert (rows[:, columns(link, "state")] == State.READY).all()
    assert not rows[:, columns(link, "torque")].any()
    wall = rows[:, columns(link, "wall")].ravel()
    assert (np.diff(wall) > 0).all()


def test_new_gains_are_in_force_from_one_row_on_and_not_before(hosted, link):
    ask(link, Kind.START)
    gather(link, link.ring.head, 50)
    changed = with_value(hosted.session.scenario, k1=0.25)
    answer = ask(link, Kind.PARAMETERS, values=changed)
    assert answer.outcome is Outcome.APPLIED
    rows = gather(link, answer.tick - 20, 40)
    command = rows[:, columns(link, "command")].ravel()
    assert (command[:20] < link.commands.done).all()
    assert (command[20:] == link.commands.done).all()


def test_what_is_refused_changes_nothing_and_says_why(hosted, link):
    ask(link, Kind.START)
    bad = parameter_column(Bank.of(hosted.session.scenario).loops[0])
    bad[-1] = -1.0
    answer = ask(link, Kind.PARAMETERS, values=bad)
    assert answer.outcome is Outcome.REFUSED and answer.reason
    again = ask(link, Kind.START)
    assert again.outcome is Outcome.REFUSED and "RUNNING" in again.reason
    assert state_of(link) is State.RUNNING


def test_a_damaged_command_is_refused_and_the_loop_goes_on(link):
    block = link.commands._slots  # as a page that went wild would
    number = link.commands.submitted + 1
    slot = block[number % len(block)]
    slot["number"], slot["kind"], slot["count"], slot["crc"] = number, 99, 7, 1
    link.commands._submitted[0] = number
    wait_for(lambda: link.commands.done == number)
    assert link.commands.answer(number).outcome is Outcome.REFUSED
    gather(link, link.ring.head, 50)
    assert ask(link, Kind.START).outcome is Outcome.APPLIED


def test_stopped_it_ticks_on_and_a_reset_makes_it_ready(link):
    ask(link, Kind.START)
    gather(link, link.ring.head, 100)
    stopped = ask(link, Kind.STOP)
    rows = gather(link, stopped.tick, 100)
    assert not rows[:, columns(link, "torque")].any()
    assert (rows[:, columns(link, "state")] == State.STOPPED).all()
    ask(link, Kind.RESET)
    rows = gather(link, link.ring.head, 5)
    assert (rows[:, columns(link, "t")] == 0).all()


def test_the_status_accounts_for_every_tick(link):
    gather(link, link.ring.head, 500)
    status = link.status.copy()
    assert abs(int(status["late_counts"].sum()) - int(status["ticks"])) <= 2
    assert abs(int(status["busy_counts"].sum()) - int(status["ticks"])) <= 2
    at, rows = link.ring.read(0)
    late, missed = rows[:, columns(link, "late")], rows[:, columns(link, "missed")]
    assert late.max() <= status["worst_late"] and missed[-1] <= link.status["missed"]
    wall, start = rows[:, columns(link, "wall")].ravel(), rows[:, columns(link, "late")].ravel()
    # Deadlines stand on a grid; those that a row skips are counted as missed. A start, stop or
    # reset begins a new one.
    quiet = np.diff(rows[:, columns(link, "command")].ravel()) == 0
    periods = np.diff(wall - start)[quiet] * 2000
    np.testing.assert_allclose(periods, np.round(periods), atol=1e-3)
    np.testing.assert_array_equal(np.round(periods) - 1, np.diff(missed.ravel())[quiet])
    assert at >= 0


def test_killed_it_is_seen_to_be_gone_and_another_one_takes_its_place(tmp_path):
    with bench(tmp_path, OWN_ARM, SLOW_RATE) as made:
        first = made.link()
        ask(first, Kind.START)
        made.kill("host")
        head, alive = first.ring.head, float(first.status["alive"])
        assert not lives(int(first.status["pid"]))
        assert state_of(first) is State.RUNNING  # its last word; who reads looks at `alive`
        time.sleep(0.1)
        assert (first.ring.head, first.status["alive"]) == (head, alive)
        made.start("host")
        second = Link.wait(made.session, newer_than=first.folder)
        assert second.folder.name == "host-2"
        assert ask(second, Kind.START).outcome is Outcome.APPLIED
        assert len(first.ring.read(0)[1])  # what was recorded stays


def test_too_many_missed_deadlines_trip_a_run_and_nothing_else(tmp_path):
    """A host that stands still for a second has missed hundreds of deadlines."""
    with bench(tmp_path, OWN_ARM, SLOW_RATE, budget=200) as made:
        link = made.link()
        for state, outcome in ((State.READY, State.READY), (State.RUNNING, State.TRIPPED)):
            assert state_of(link) is state
            missed = int(link.status["missed"])
            made.processes["host"].send_signal(signal.SIGSTOP)
            time.sleep(1.0)
            made.processes["host"].send_signal(signal.SIGCONT)
            wait_for(lambda: link.status["missed"] > missed + 200)  # noqa: B023
            gather(link, link.ring.head, 3)
            assert state_of(link) is outcome
            ask(link, Kind.START)
        assert link.status["trip"] == DEADLINES
        assert b"more than 200 deadlines" in link.status["reason"]
        assert not gather(link, link.ring.head, 5)[:, columns(link, "torque")].any()


def test_asked_to_end_it_stops_first_and_ends_with_0(tmp_path):
    with bench(tmp_path, OWN_ARM, SLOW_RATE) as made:
        link = made.link()
        ask(link, Kind.START)
        made.processes["host"].terminate()
        assert made.processes["host"].wait(60) == 0
        assert state_of(link) is State.STOPPED
        last = link.ring.read(link.ring.head - 1)[1][0]
        assert not last[columns(link, "torque")].any()


def test_a_folder_without_session_is_an_error_in_words(tmp_path):
    # In a process of its own: a host ignores Ctrl-C from then on, and so would all that follows.
    command = [sys.executable, "-m", "alight.live.host", str(tmp_path)]
    done = subprocess.run(command, env=environment(), capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "is no session" in done.stderr
