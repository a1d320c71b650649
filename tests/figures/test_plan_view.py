"""The plan view draws arm, body and path where the recording says they were."""

import functools

import matplotlib
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from alight import AlightError, Recording, Scenario, load_scenario, simulate
from alight.figures import plan_view, save
from alight.figures.scene import arm_points, motion_of, zigzag

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


def arms(ax) -> list:
    """The drawn arms: lines through base, elbow and tip, in the order of drawing."""
    return [line for line in ax.get_lines() if len(line.get_xdata()) == 3]


def labelled(ax, label: str):
    (found,) = [line for line in ax.get_lines() if str(line.get_label()).startswith(label)]
    return found


def test_links_keep_their_lengths_and_end_at_the_recorded_tip():
    recording, scenario = strike()
    motion = motion_of(recording, scenario)
    arm = scenario.plant.arm
    q1 = recording["q1"]
    np.testing.assert_allclose(motion.elbow, arm.l1 * np.column_stack([np.cos(q1), np.sin(q1)]))
    second = np.linalg.norm(recording["x_r"] - motion.elbow, axis=1)
    np.testing.assert_allclose(second, arm.l2, rtol=1e-12)
    x1, x2 = arm_points(motion, 17)
    assert (x1[0], x2[0]) == (0.0, 0.0)
    np.testing.assert_array_equal([x1[2], x2[2]], recording["x_r"][17])


def test_each_arm_drawn_ends_at_the_tip_of_its_instant():
    recording, scenario = strike()
    samples = [0, 100, 333, 799]
    ax = plan_view(recording, scenario, instants=recording.t[samples].tolist()).axes[0]
    tips = [(line.get_xdata()[2], line.get_ydata()[2]) for line in arms(ax)]
    np.testing.assert_array_equal(tips, recording["x_r"][samples])


def test_the_arm_fades_in():
    ax = plan_view(*strike()).axes[0]
    brightness = [sum(to_rgb(line.get_color())) for line in arms(ax)]
    assert len(brightness) >= 3
    assert (np.diff(brightness) < 0).all()
    assert brightness[-1] == 0.0


def test_poses_run_from_the_start_through_the_first_contact_to_the_end():
    recording, scenario = strike()
    touch = int(np.argmax(recording["Lambda"] > 0))
    assert touch > 0, "this run must strike"
    ax = plan_view(recording, scenario).axes[0]
    tips = np.array([(line.get_xdata()[2], line.get_ydata()[2]) for line in arms(ax)])
    for sample in (0, touch, -1):
        assert (tips == recording["x_r"][sample]).all(axis=1).any()
    mark = labelled(ax, "first contact")
    np.testing.assert_array_equal(mark.get_xydata(), recording["x_r"][[touch]])
    assert f"{recording.t[touch]:.4f} s" in mark.get_label()


def test_the_path_is_the_recorded_path_of_the_tip_at_equal_scales():
    recording, scenario = strike()
    ax = plan_view(recording, scenario).axes[0]
    np.testing.assert_array_equal(labelled(ax, "path of the tip").get_xydata(), recording["x_r"])
    assert ax.get_aspect() == 1.0
    target = labelled(ax, "target").get_xydata()[0]
    np.testing.assert_array_equal(target, [scenario.target.x_md, scenario.target.x_rd2])
    assert ax.get_xlabel() == "$X_1$ [m]"
    assert ax.get_ylabel() == "$X_2$ [m]"


def test_in_contact_the_face_of_the_body_is_at_the_tip_and_otherwise_at_the_mass():
    motion = motion_of(*strike())
    assert motion.contact.any()
    assert not motion.contact.all()
    np.testing.assert_allclose(motion.face[motion.contact], motion.tip[motion.contact, 0])
    np.testing.assert_array_equal(motion.face[~motion.contact], motion.x_m[~motion.contact])


def test_the_plate_is_drawn_with_its_face_where_it_was():
    recording, scenario = strike()
    ax = plan_view(recording, scenario).axes[0]
    plate = ax.patches[0]
    assert plate.get_x() == motion_of(recording, scenario).face[-1]


def test_everything_drawn_of_arm_and_body_lies_inside_the_axes():
    ax = plan_view(*strike()).axes[0]
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    for line in arms(ax):
        assert left < line.get_xdata().min()
        assert low < line.get_ydata().min()
        assert line.get_ydata().max() < high
    for patch in ax.patches:
        assert left < patch.get_x()
        assert patch.get_x() + patch.get_width() < right
        assert low < patch.get_y()
        assert patch.get_y() + patch.get_height() < high


def test_a_run_without_contact_has_no_contact_mark():
    ax = plan_view(*approach()).axes[0]
    assert len(arms(ax)) > 2
    assert not [line for line in ax.get_lines() if "contact" in str(line.get_label())]


@pytest.mark.parametrize("instants", [[-0.1], [0.1, 5.0], [float("nan")], []])
def test_instants_outside_the_recording_are_refused(instants):
    with pytest.raises(AlightError, match="instants"):
        plan_view(*strike(), instants=instants)


def test_axes_of_the_caller_keep_their_size_and_the_global_settings_stay(tmp_path):
    mine = Figure(figsize=(3.0, 3.0))
    before = dict(matplotlib.rcParams)
    assert plan_view(*strike(), ax=mine.subplots()) is mine
    save(mine, tmp_path / "plan.png")
    assert dict(matplotlib.rcParams) == before
    assert tuple(mine.get_size_inches()) == (3.0, 3.0)


def test_a_spring_is_drawn_from_end_to_end():
    corners = zigzag(0.3, 0.5, 0.1, coils=4, width=0.02)
    np.testing.assert_allclose(corners[[0, -1]], [[0.3, 0.1], [0.5, 0.1]])
    assert (np.diff(corners[:, 0]) > 0).all()
    np.testing.assert_allclose(np.abs(corners[:, 1] - 0.1).max(), 0.02)
