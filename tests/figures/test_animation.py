"""The animation shows the frames that it declares, and the impact in slow motion."""

import functools
import itertools

import matplotlib
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure
from PIL import Image

from alight import AlightError, Recording, Scenario, load_scenario, simulate
from alight.figures import animate
from alight.figures.storyboard import storyboard

SHORT = ["duration=0.4", "steady_state=0.1", "start.x_r=[0.19, 0.37]"]


@functools.cache
def strike() -> tuple[Recording, Scenario]:
    scenario = load_scenario("experiment-1", SHORT)
    return simulate(scenario, backend="vm"), scenario


@functools.cache
def approach() -> tuple[Recording, Scenario]:
    """A run that ends before it touches anything."""
    scenario = load_scenario("experiment-1", ["duration=0.01", "steady_state=0.01"])
    return simulate(scenario, backend="vm"), scenario


@given(frames=st.integers(2, 300), until=st.none() | st.floats(0.15, 2.0))
def test_frames_show_ascending_samples_from_the_start_to_the_end(frames, until):
    recording, _ = strike()
    samples, slowdown = storyboard(recording, frames, until)
    assert len(samples) == len(slowdown) == frames
    assert samples[0] == 0
    assert (np.diff(samples) > 0).all()
    end = min(recording.t[-1], np.inf if until is None else until)
    assert recording.t[samples[-1]] == pytest.approx(end, abs=0.5e-3)


def test_the_impact_is_the_slowest_part():
    recording, _ = strike()
    samples, slowdown = storyboard(recording, 100)
    touch = int(np.argmax(recording["Lambda"] > 0))
    assert touch > 0, "this run must strike"
    at_impact = slowdown[np.argmin(np.abs(samples - touch))]
    assert at_impact == pytest.approx(slowdown.max())
    assert slowdown[-1] < at_impact / 2


@pytest.mark.parametrize("run", [strike, approach])
@pytest.mark.parametrize("frames", [-3, 1, 801])
def test_a_number_of_frames_out_of_range_is_refused(run, frames):
    with pytest.raises(AlightError, match=f"frames = {frames}"):
        storyboard(run()[0], frames)


def test_the_file_has_the_declared_frames_and_every_one_differs_from_the_one_before(tmp_path):
    path = tmp_path / "strike.gif"
    animate(*strike(), path, frames=12)
    with Image.open(path) as film:
        assert film.n_frames == 12
        assert film.info["loop"] == 0
        pictures = []
        for frame in range(12):
            film.seek(frame)
            assert film.info["duration"] >= 20, "players slow down frames that are shorter"
            pictures.append(np.asarray(film.convert("RGB")))
    for before, after in itertools.pairwise(pictures):
        assert (before != after).any()
    assert (pictures[0] != pictures[-1]).sum() > 1000
    assert (pictures[0][0, 0] == 255).all(), "the ground is white"


def test_a_whole_film_is_small(tmp_path):
    path = tmp_path / "strike.gif"
    animate(*strike(), path)
    assert path.stat().st_size < 3e6


def test_the_figure_returned_shows_the_last_frame(tmp_path):
    recording, scenario = strike()
    mine = Figure(figsize=(5, 3))
    shown_on, before = mine.canvas, dict(matplotlib.rcParams)
    assert animate(recording, scenario, tmp_path / "a.gif", frames=3, fig=mine) is mine
    assert mine.canvas is shown_on
    assert dict(matplotlib.rcParams) == before
    lines = [line for ax in mine.axes for line in ax.get_lines()]
    (arm,) = [line for line in lines if len(line.get_xdata()) == 3]
    np.testing.assert_array_equal(arm.get_xydata()[2], recording["x_r"][-1])
    assert not any(line.get_animated() for line in lines)
    force, compression = mine.axes[1], mine.axes[2]
    np.testing.assert_array_equal(force.get_lines()[0].get_ydata(), recording["F_m"])
    np.testing.assert_allclose(
        compression.get_lines()[0].get_ydata(),
        1e3 * (recording["x_m"] - scenario.plant.body.x_0),
    )


def test_the_film_says_when_the_plate_touches_the_probe(tmp_path):
    recording, _ = strike()
    deepest = int(np.argmax(recording["gap"]))
    until = float(recording.t[deepest])
    told = []
    for share in (0.5, 2.0):
        clearance = share * recording["gap"][deepest]
        scenario = load_scenario("experiment-1", [*SHORT, f"testbed.probe.clearance={clearance}"])
        run = simulate(scenario, backend="vm")
        fig = animate(run, scenario, tmp_path / "a.gif", frames=2, until=until)
        told.append("touches the probe" in fig.axes[0].get_title("right"))
    assert told == [True, False]


def test_a_run_without_contact_can_be_shown(tmp_path):
    path = tmp_path / "approach.gif"
    animate(*approach(), path, frames=4)
    with Image.open(path) as film:
        assert film.n_frames == 4


def test_another_suffix_is_refused(tmp_path):
    with pytest.raises(AlightError, match=r"\.gif"):
        animate(*strike(), tmp_path / "strike.mp4")
    assert not list(tmp_path.iterdir())


def test_a_missing_folder_is_named(tmp_path):
    with pytest.raises(AlightError, match="nowhere"):
        animate(*approach(), tmp_path / "nowhere" / "strike.gif", frames=2)
