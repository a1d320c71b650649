"""Figs. 4 to 8 show the signals of the recordings, in the paper's panels and line styles."""

import dataclasses
import functools

import matplotlib
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from alight import Outcome, Recording, Verdict, load_scenario, simulate
from alight.figures import (
    applied_against_computed,
    computed_torques,
    desired_trajectory,
    errors,
    torques,
)
from alight.symbolic.signals import Layout, Signal

SHORT = ["duration=0.4", "steady_state=0.1", "start.x_r=[0.19, 0.37]"]


@functools.cache
def limiting() -> Recording:
    return simulate(load_scenario("experiment-1", SHORT), backend="vm")


@functools.cache
def unsaturated() -> Recording:
    return simulate(load_scenario("experiment-2", SHORT), backend="vm")


def cut_short(recording: Recording, samples: int, last: float = np.nan) -> Recording:
    """The start of a run as if it had tripped, its last values replaced by a blow-up."""
    rows = recording.samples[:samples].copy()
    rows[-1] = last
    end = float(recording.t[samples - 1])
    verdict = Verdict(Outcome.TRIPPED, end, "u_f", "the filter state reached 1")
    return dataclasses.replace(recording, t=recording.t[:samples], samples=rows, verdict=verdict)


def signal_lines(ax: Axes) -> list:
    """Lines with a sample for each instant; not those that mark a level or an instant."""
    return [line for line in ax.get_lines() if len(line.get_xdata()) > 2]


def one_signal(values: np.ndarray) -> Recording:
    layout = Layout({"x_rd1": Signal("m", "desired tip position")})
    t = np.linspace(0.0, 1.0, len(values))
    return Recording(t, values[:, None], layout, Verdict(Outcome.COMPLETED, 1.0))


@pytest.mark.parametrize(
    ("panel", "column", "label"),
    [(0, "e_r1", "$e_{r1}$ [mm]"), (1, "e_r2", "$e_{r2}$ [mm]"), (2, "e_m", "$e_m$ [mm]")],
)
def test_errors_stand_in_millimetres_solid_for_32_and_dashed_for_44(panel, column, label):
    ax = errors(limiting(), unsaturated(), steady_state=None).axes[panel]
    solid, dashed = signal_lines(ax)
    np.testing.assert_array_equal(solid.get_ydata(), 1e3 * limiting()[column])
    np.testing.assert_array_equal(dashed.get_ydata(), 1e3 * unsaturated()[column])
    np.testing.assert_array_equal(solid.get_xdata(), limiting().t)
    assert (solid.get_linestyle(), dashed.get_linestyle()) == ("-", "--")
    assert to_hex(solid.get_color()) == to_hex(dashed.get_color()) == "#000000"
    assert ax.get_ylabel() == label
    assert ax.get_title("left") == f"({'abc'[panel]})"


def test_the_steady_state_column_names_the_peaks_of_the_last_part():
    axes = errors(limiting(), unsaturated(), steady_state=0.1).axes
    assert len(axes) == 6
    beside_e_m = axes[5]
    told = [text.get_text() for text in beside_e_m.get_legend().get_texts()]
    peaks = [
        1e6 * np.abs(run["e_m"][run.t > run.t[-1] - 0.1]).max()
        for run in (limiting(), unsaturated())
    ]
    assert told == [f"peak {peak:.3g} µm" for peak in peaks]
    for line, run in zip(signal_lines(beside_e_m), (limiting(), unsaturated()), strict=True):
        np.testing.assert_array_equal(line.get_ydata(), 1e6 * run.last(0.1)["e_m"])
    low, high = beside_e_m.get_ylim()
    assert low < 0 < high


def test_recordings_of_different_length_share_an_axis_that_holds_the_longer():
    short = dataclasses.replace(limiting(), t=limiting().t[:100], samples=limiting().samples[:100])
    ax = errors(short, unsaturated(), steady_state=None).axes[0]
    assert len(signal_lines(ax)[0].get_xdata()) == 100
    assert ax.get_xlim() == (0.0, pytest.approx(0.4))


@pytest.mark.parametrize("last", [np.nan, np.inf, 1e9])
def test_a_run_that_ended_early_is_marked_with_its_verdict_and_does_not_set_the_scale(last):
    early = cut_short(limiting(), 600, last)
    fig = errors(early, unsaturated(), steady_state=0.1)
    fig.draw_without_rendering()
    ax = fig.axes[0]
    (note,) = [text.get_text() for text in ax.texts]
    assert "(32)" in note
    assert "tripped at 0.2995 s by u_f" in note
    marks = [line for line in ax.get_lines() if len(line.get_xdata()) == 2]
    assert [line.get_xdata()[0] for line in marks] == [early.t[-1]]
    assert max(np.abs(ax.get_ylim())) < 1e4
    beside = fig.axes[1]
    assert len(signal_lines(beside)) == 1, "a run that ended early has no steady state"


def test_both_runs_may_end_early():
    fig = errors(cut_short(limiting(), 700), cut_short(unsaturated(), 500))
    assert len(fig.axes) == 3
    assert len(fig.axes[0].texts) == 2


@pytest.mark.parametrize(
    ("draw", "run", "column"),
    [(torques, limiting, "tau_applied"), (computed_torques, unsaturated, "tau")],
)
def test_torques_of_both_motors_are_those_of_the_recording(draw, run, column):
    fig = draw(run(), start=None)
    for motor, (ax, name) in enumerate(
        zip(fig.axes, ["(a) base motor", "(b) second link motor"], strict=True), start=1
    ):
        (line,) = signal_lines(ax)
        np.testing.assert_array_equal(line.get_ydata(), run()[f"{column}{motor}"])
        assert line.get_linestyle() == "-"
        assert ax.get_title("left") == name
        assert "[N m]" in ax.get_ylabel()


def test_applied_torque_is_solid_and_the_computed_one_dashed():
    fig = applied_against_computed(unsaturated(), start=None)
    for motor, ax in enumerate(fig.axes, start=1):
        solid, dashed = signal_lines(ax)
        np.testing.assert_array_equal(solid.get_ydata(), unsaturated()[f"tau_applied{motor}"])
        np.testing.assert_array_equal(dashed.get_ydata(), unsaturated()[f"tau{motor}"])
        assert (solid.get_linestyle(), dashed.get_linestyle()) == ("-", "--")


def with_torques(applied: float, computed: float) -> Recording:
    """A run whose torques have the given peaks at both motors."""
    run = unsaturated()
    rows = run.samples.copy()
    shape = np.sin(20 * run.t)[:, None]
    slices = run.layout.slices()
    rows[:, slices["tau"]] = computed * shape
    rows[:, slices["tau_applied"]] = np.clip(computed * shape, -applied, applied)
    return dataclasses.replace(run, samples=rows)


def test_a_cut_panel_says_how_far_the_computed_torque_goes_and_the_start_is_not_cut():
    run = with_torques(applied=10.0, computed=1000.0)
    fig = applied_against_computed(run, start=0.35)
    paper, beside = fig.axes[0], fig.axes[1]
    assert paper.get_ylim() == (-30.0, 30.0)
    (note,) = [text.get_text() for text in paper.texts]
    assert f"{run['tau1'].min():.0f}".replace("-", "\u2212") in note
    assert f"{run['tau1'].max():.0f}" in note
    first = run["tau1"][run.t <= 0.35]
    assert beside.get_ylim()[0] <= first.min()
    assert beside.get_ylim()[1] >= first.max()


def test_a_panel_that_holds_everything_is_not_cut():
    run = with_torques(applied=10.0, computed=12.0)
    paper = applied_against_computed(run, start=None).axes[0]
    assert not paper.texts
    assert paper.get_ylim()[0] < run["tau1"].min()
    assert paper.get_ylim()[1] > run["tau1"].max()


def test_the_first_contact_is_marked_in_the_enlarged_start():
    touching = limiting().t[limiting()["Lambda"] > 0]
    assert len(touching), "this run must strike"
    beside = torques(limiting(), start=0.35).axes[1]
    marks = [line.get_xdata()[0] for line in beside.get_lines() if len(line.get_xdata()) == 2]
    assert marks == [touching[0]]


def test_the_desired_trajectory_is_x_rd1_in_metres():
    fig = desired_trajectory(limiting(), start=None)
    (line,) = signal_lines(fig.axes[0])
    np.testing.assert_array_equal(line.get_ydata(), limiting()["x_rd1"])
    assert line.get_linestyle() == "-"
    assert fig.axes[0].get_ylabel() == "$x_{rd1}$ [m]"


@given(
    start=st.floats(-1, 1),
    settled=st.floats(-1, 1),
    ripple=st.floats(0, 0.1),
    decay=st.floats(10, 40),
)
def test_the_inset_of_the_desired_trajectory_covers_no_part_of_the_line(
    start, settled, ripple, decay
):
    t = np.linspace(0.0, 1.0, 300)
    values = settled + (start - settled) * np.exp(-decay * t) + ripple * np.sin(50 * t)
    ax = desired_trajectory(one_signal(values), start=0.1).axes[0]
    (inset,) = ax.child_axes
    box = inset.get_position()
    in_axes = ax.transAxes.inverted().transform(
        ax.transData.transform(np.column_stack([t, values]))
    )
    outer = ax.get_position()
    left = (box.x0 - outer.x0) / outer.width
    low, high = ((y - outer.y0) / outer.height for y in (box.y0, box.y1))
    beside = in_axes[in_axes[:, 0] >= left, 1]
    assert ((beside < low) | (beside > high)).all()
    assert ((beside >= 0) & (beside <= 1)).all()


DRAWINGS = {
    "errors": lambda **on: errors(limiting(), unsaturated(), 0.1, **on),
    "torques": lambda **on: torques(limiting(), 0.2, **on),
    "computed_torques": lambda **on: computed_torques(unsaturated(), 0.2, **on),
    "applied_against_computed": lambda **on: applied_against_computed(unsaturated(), 0.2, **on),
}


@pytest.mark.parametrize("name", DRAWINGS)
def test_a_figure_of_the_caller_is_drawn_into_and_returned(name):
    mine = Figure()
    assert DRAWINGS[name](fig=mine) is mine
    assert mine.axes
    left, _ = (whole := Figure()).subfigures(1, 2)
    assert DRAWINGS[name](fig=left) is whole
    assert left.axes


def test_axes_of_the_caller_are_drawn_into():
    mine = Figure().subplots(1, 2)
    assert desired_trajectory(limiting(), ax=mine[1]) is mine[1].figure
    assert signal_lines(mine[1])
    assert not signal_lines(mine[0])


def pixels(fig: Figure) -> np.ndarray:
    """What the figure looks like on a canvas of the caller's."""
    canvas = FigureCanvasAgg(fig)
    canvas.draw()
    return np.array(canvas.buffer_rgba())


@pytest.mark.parametrize("name", [*DRAWINGS, "desired_trajectory"])
def test_global_settings_neither_change_nor_shape_the_figure(name):
    draw = {**DRAWINGS, "desired_trajectory": lambda: desired_trajectory(limiting())}[name]
    plain = pixels(draw())
    mine = {"lines.linewidth": 7.0, "font.size": 30.0, "xtick.direction": "out", "axes.grid": True}
    with matplotlib.rc_context(mine):
        before = dict(matplotlib.rcParams)
        styled = pixels(draw())
        assert dict(matplotlib.rcParams) == before
    assert (styled == plain).all()


@pytest.mark.parametrize("name", DRAWINGS)
def test_no_text_of_a_figure_overlaps_another(name):
    fig = DRAWINGS[name]()
    fig.draw_without_rendering()
    boxes = []
    for ax in fig.axes:
        legend = ax.get_legend()
        texts = [ax.title, *ax.texts, ax.xaxis.label, ax.yaxis.label]
        texts += [ax._left_title, *(legend.get_texts() if legend else [])]
        boxes += [text.get_window_extent() for text in texts if text.get_text()]
    assert len(boxes) > 4
    for i, box in enumerate(boxes):
        assert not any(box.overlaps(other) for other in boxes[i + 1 :])
