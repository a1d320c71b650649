"""One run in free motion, one in contact and one through impacts, against MuJoCo.

Independent here: MuJoCo's multibody dynamics from masses and centres of mass, its kinematics and
Jacobians, its joint spring, its Runge-Kutta integrator. MuJoCo's own contact is a soft constraint
that cannot be made a linear spring. So (7) enters as a passive force that this test computes from
MuJoCo's own tip and mass positions, and MuJoCo maps to the joints; what is *not* independent is
that one line, ``K_I max(gap, 0)``.

Two comparisons. Alight's tight integration (adaptive, order 8) is the limit to which MuJoCo must
converge at its integrator's order when its step is halved. And Alight's rates, stepped by MuJoCo's
method, the classical one of Runge and Kutta, must agree with it at each step size to rounding,
errors and all, even where the kink of (7) costs the method its order.
"""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Iterator
from typing import NamedTuple

import casadi as ca
import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from alight.models import LinearSpring, MassSpring, Plant, PlantState
from alight.simulation.closed_loop import PLANT
from alight.symbolic.build import build
from tests.simulation.classical import classical_step
from tests.strategies import Links

LINKS = Links(l=(0.35, 0.3), m=(6.0, 2.0), l_c=(0.17, 0.14), inertia=(0.08, 0.02))
BODY = MassSpring(m=1.5, k_s=600.0, x_0=0.2)
PLANT_UNDER_TEST = Plant(LINKS.arm(), BODY, LinearSpring(K_I=2e4))
HOLD = 0.01  # [s] over which a torque is held


class Case(NamedTuple):
    tip: tuple[float, float]
    q_dot: tuple[float, float]
    x_m: float
    x_m_dot: float
    torque: tuple[float, float]
    """Largest torques [N m] of a random history."""
    holds: int

    @property
    def start(self) -> np.ndarray:
        q = PLANT_UNDER_TEST.arm.inverse(self.tip, "-")
        s = PlantState(q, np.array(self.q_dot), self.x_m, self.x_m_dot, 0.0)
        return PLANT.pack(s._asdict())

    @property
    def torques(self) -> np.ndarray:
        uniform = np.random.default_rng(0).uniform(-1.0, 1.0, (self.holds, 2))
        return uniform * np.array(self.torque)


FREE = Case((-0.1, 0.4), (-1.0, 2.0), 0.2, 0.3, torque=(5.0, 1.0), holds=30)
PRESSED = Case((0.2412, 0.4), (0.1, -0.2), 0.24, 0.0, torque=(1.0, 0.2), holds=6)
STRUCK = Case((0.19, 0.4), (-1.0, 1.0), 0.2, 0.0, torque=(2.0, 0.3), holds=20)


# MuJoCo


def link(i: int, place: float, inside: str) -> str:
    spin = LINKS.inertia[i]
    return f"""
      <body name="link{i + 1}" pos="{place} 0 0">
        <inertial pos="{LINKS.l_c[i]} 0 0" mass="{LINKS.m[i]}" diaginertia="{spin} {spin} {spin}"/>
        <joint name="q{i + 1}" type="hinge" axis="0 0 1"/>{inside}
      </body>"""


SECOND = link(1, LINKS.l[0], f'<site name="tip" pos="{LINKS.l[1]} 0 0"/>')
MJCF = f"""
<mujoco>
  <compiler angle="radian"/>
  <option gravity="0 0 0" integrator="RK4"><flag contact="disable"/></option>
  <worldbody>{link(0, 0.0, SECOND)}
    <body name="mass" pos="{BODY.x_0} 0 0">
      <inertial pos="0 0 0" mass="{BODY.m}" diaginertia="1 1 1"/>
      <joint name="x_m" type="slide" axis="1 0 0" stiffness="{BODY.k_s}"/>
    </body>
  </worldbody>
  <actuator><motor joint="q1"/><motor joint="q2"/></actuator>
</mujoco>"""


def push(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Contact force (7) between the tip and the mass, as a passive force of MuJoCo."""
    tip, mass = data.site("tip").xpos, data.body("mass").xpos
    force = np.array([PLANT_UNDER_TEST.contact.K_I * max(tip[0] - mass[0], 0.0), 0.0, 0.0])
    for name, pushed, point in (("link2", -force, tip), ("mass", force, mass)):
        body = model.body(name).id
        mujoco.mj_applyFT(model, data, pushed, np.zeros(3), point, body, data.qfrc_passive)


@contextlib.contextmanager
def contact() -> Iterator[None]:
    mujoco.set_mjcb_passive(push)  # a global of MuJoCo, called while a model compiles, too
    try:
        yield
    finally:
        mujoco.set_mjcb_passive(None)


def mujoco_run(case: Case, steps: int) -> np.ndarray:
    """States ``(q, q_dot, x_m, x_m_dot)`` after each held torque, with so many steps in each."""
    model = mujoco.MjModel.from_xml_string(MJCF)
    model.opt.timestep = HOLD / steps
    data = mujoco.MjData(model)
    s = PLANT.unpack(case.start)
    data.qpos[:] = [*s["q"], s["x_m"] - BODY.x_0]
    data.qvel[:] = [*s["q_dot"], s["x_m_dot"]]
    states = []
    with contact():
        for tau in case.torques:
            data.ctrl[:] = tau
            mujoco.mj_step(model, data, nstep=steps)
            q, q_dot = data.qpos[:2], data.qvel[:2]
            states.append([*q, *q_dot, data.qpos[2] + BODY.x_0, data.qvel[2]])
    return np.array(states)


# Alight


@functools.cache
def functions() -> tuple[ca.Function, ca.Function]:
    """Rates of the plant, and one step of MuJoCo's method with them."""
    column, tau, dt = ca.SX.sym("column", PLANT.size), ca.SX.sym("tau", 2), ca.SX.sym("dt")

    def rates(x: ca.SX) -> ca.SX:
        return PLANT.pack(PLANT_UNDER_TEST.rates(PlantState(**PLANT.unpack(x)), tau)._asdict())

    return (
        build("rates", {"column": column, "tau": tau}, {"rates": rates(column)}),
        build(
            "step",
            {"column": column, "tau": tau, "dt": dt},
            {"following": classical_step(rates, column, dt)},
        ),
    )


def stepped_alike(case: Case, steps: int) -> np.ndarray:
    step = functions()[1].mapaccum(steps)
    x, states = case.start, []
    for tau in case.torques:
        x = step(x, tau, HOLD / steps).full()[:, -1]
        states.append(x[:6])
    return np.array(states)


def tight_run(case: Case) -> tuple[np.ndarray, np.ndarray]:
    """States after each held torque, and the gap at every step that the integrator took."""
    rates = functions()[0]
    x, states, passed = case.start, [], []
    for tau in case.torques:
        run = solve_ivp(
            lambda t, x, tau=tau: rates(x, tau).full()[:, 0],
            (0.0, HOLD),
            x,
            method="DOP853",
            rtol=1e-13,
            atol=1e-13,
        )
        x = run.y[:, -1]
        passed.extend(run.y.T)
        states.append(x[:6])
    return np.array(states), gaps(np.array(passed))


def gaps(states: np.ndarray) -> np.ndarray:
    return np.array([PLANT_UNDER_TEST.arm.x_r(x[:2])[0] - x[4] for x in states])


# Comparisons


@pytest.mark.parametrize(("case", "sign"), [(FREE, -1), (PRESSED, 1)], ids=["free", "contact"])
def test_mujoco_converges_to_alight_with_the_order_of_its_integrator(case, sign):
    limit, passed = tight_run(case)
    assert (np.sign(passed) == sign).all()
    steps = (4, 8, 16, 32)
    runs = [mujoco_run(case, n) for n in steps]
    differences = [np.abs(run - limit).max() for run in runs]
    np.testing.assert_allclose(np.log2(np.divide(differences[:-1], differences[1:])), 4.0, atol=0.3)
    # MuJoCo's own estimate of its step error, by halving the step, covers the difference.
    step_error = np.abs(runs[-1] - runs[-2]).max() / (2**4 - 1)
    assert differences[-1] <= 1.2 * step_error


@pytest.mark.parametrize("case", [FREE, PRESSED, STRUCK], ids=["free", "contact", "impacts"])
@pytest.mark.parametrize("steps", [2, 8, 32])
def test_the_same_step_makes_the_same_error(case, steps):
    found, expected = stepped_alike(case, steps), mujoco_run(case, steps)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11)
    assert np.abs(expected - tight_run(case)[0]).max() > 1e-11  # there is a step error to share


def test_through_impacts_mujoco_still_converges_to_alight():
    """At each touch and separation the kink of (7) leaves a Runge-Kutta step of order 4 order 2."""
    limit, passed = tight_run(STRUCK)
    changes = np.abs(np.diff(passed > 0)).sum()
    assert passed[0] < 0 and changes >= 3
    steps = np.array([2, 4, 8, 16, 32, 64, 128])
    differences = [np.abs(mujoco_run(STRUCK, n) - limit).max() for n in steps]
    order = -np.polyfit(np.log(steps), np.log(differences), 1)[0]
    assert order > 1.7
    assert differences[-1] < 1e-5
