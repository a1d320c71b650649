"""Arm, body and contact together: power balance, conservation and dissipation of energy."""

from __future__ import annotations

import functools
from typing import Any

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from alight.models import (
    HuntCrossley,
    KelvinVoigt,
    LinearSpring,
    MassSpring,
    Plant,
    PlantState,
    TipFriction,
    TwoLinkArm,
)
from alight.simulation.closed_loop import PLANT, phases_of
from alight.symbolic.build import build
from alight.symbolic.derive import time_derivative
from alight.symbolic.ops import dot, vector
from alight.symbolic.parameters import rebind
from tests.lifted import Evaluate, lifted
from tests.strategies import CONTACT_LAWS, Plane, between, plant_states, plants, vectors

ARM = TwoLinkArm(l1=0.35, l2=0.3, p1=3.4, p2=0.2, p3=0.24)
BODY = MassSpring(m=1.5, k_s=600.0, x_0=0.2)
LOSSLESS = Plant(arm=ARM, body=BODY, contact=LinearSpring(K_I=2e4))


def as_column(s: PlantState) -> np.ndarray:
    return PLANT.pack(s._asdict())


def as_state(column: Any) -> PlantState:
    return PlantState(**PLANT.unpack(column))


@functools.cache
def mechanics(contact: type, plane: Plane) -> Evaluate:
    template = Plant(
        arm=TwoLinkArm(l1=1.0, l2=1.0, p1=3.0, p2=1.0, p3=0.5, plane=plane),
        body=BODY,
        contact=contact(),
    )

    def expressions(plant: Any, column: Any, tau: Any) -> dict[str, Any]:
        s = as_state(column)
        rates = plant.rates(s, tau)
        touch = plant.touch(s)
        x_r_dot = plant.arm.J(s.q) @ s.q_dot
        losses = [
            dot(plant.arm.friction(s.q_dot), s.q_dot),
            plant.body.damping * s.x_m_dot**2,
            (touch.F_m - plant.contact.force(touch.gap, 0.0)) * (x_r_dot[0] - s.x_m_dot),
            touch.F_t * x_r_dot[1],
        ]
        rate = time_derivative(
            lambda x: plant.energy(as_state(x)),
            [column],
            [PLANT.pack(rates._asdict())],
            constants=plant,
        )
        return {
            "rates": PLANT.pack(rates._asdict()),
            "energy": plant.energy(s),
            "energy_rate": rate,
            "drive": dot(tau, s.q_dot),
            "lift": dot(plant.arm.h(s.q), s.q_dot),
            "losses": vector(*losses),
            "touch": vector(touch.gap, touch.Lambda, touch.F_m, touch.F_t),
        }

    return lifted(template, {"state": PLANT.size, "tau": 2}, expressions)


def at(plant: Plant, s: PlantState, tau: Any = (0.0, 0.0)) -> dict[str, np.ndarray]:
    found = mechanics(type(plant.contact), plant.arm.plane)(plant, as_column(s), tau)
    return {name: v[0] if v.size == 1 else v for name, v in found.items()}


def power_scale(found: dict[str, np.ndarray], plant: Plant, s: PlantState) -> float:
    """Size of the powers that cancel in a balance [W]."""
    elastic = plant.body.k_s * abs(plant.body.Y_d(s.x_m) * s.x_m_dot)
    flows = [found["drive"], found["lift"], *found["losses"], elastic]
    contact = found["touch"][2] * (abs(s.x_m_dot) + np.abs(s.q_dot).sum())
    return 1e-3 + sum(abs(flow) for flow in flows) + contact + abs(found["energy"])


CONTACTS = pytest.mark.parametrize("contact", list(CONTACT_LAWS), ids=lambda law: law.__name__)


# Power balance, at every state


@CONTACTS
@given(st.data(), vectors(2, 50.0))
def test_energy_changes_by_the_power_of_the_motors_less_the_losses(contact, data, tau):
    plant = data.draw(plants(CONTACT_LAWS[contact](), plane="vertical"))
    s = data.draw(plant_states(plant))
    found = at(plant, s, tau)
    balance = found["drive"] - found["lift"] - found["losses"].sum()
    scale = power_scale(found, plant, s)
    assert found["energy_rate"] == pytest.approx(balance, rel=0, abs=1e-10 * scale)


@given(st.data(), vectors(2, 50.0))
def test_without_friction_the_linear_spring_plant_takes_exactly_the_motors_power(data, tau):
    plant = data.draw(plants(CONTACT_LAWS[LinearSpring](), friction=False))
    plant = rebind(plant, body=rebind(plant.body, damping=0.0))
    s = data.draw(plant_states(plant))
    found = at(plant, s, tau)
    scale = power_scale(found, plant, s)
    assert not found["losses"].any()
    assert found["energy_rate"] == pytest.approx(tau @ s.q_dot, rel=0, abs=1e-10 * scale)


@CONTACTS
@given(st.data())
def test_joint_friction_body_and_contact_only_take_energy(contact, data):
    plant = data.draw(plants(CONTACT_LAWS[contact]()))
    s = data.draw(plant_states(plant))
    joints, body, damper, _ = at(plant, s)["losses"]
    scale = power_scale(at(plant, s), plant, s)
    assert joints >= 0 and body >= 0 and damper >= -1e-12 * scale


@CONTACTS
@given(st.data())
def test_numbers_and_expressions_give_the_same_rates(contact, data):
    plant = data.draw(plants(CONTACT_LAWS[contact]()))
    s = data.draw(plant_states(plant))
    tau = np.array([3.0, -1.0])
    numeric, symbolic = as_column(plant.rates(s, tau)), at(plant, s, tau)["rates"]
    np.testing.assert_allclose(numeric, symbolic, rtol=1e-9, atol=1e-9 * np.abs(numeric).max())
    assert plant.energy(s) == pytest.approx(at(plant, s)["energy"], rel=1e-12)


@given(st.data())
def test_in_free_motion_arm_and_body_know_nothing_of_each_other(data):
    plant = data.draw(plants())
    s = data.draw(plant_states(plant, deepest=0.0))
    s = s._replace(x_m=float(plant.arm.x_r(s.q)[0]) + 0.05)
    gap, Lambda, F_m, F_t = at(plant, s)["touch"]
    assert gap < 0 and Lambda == F_m == F_t == 0


@given(st.data())
def test_theta_dk_is_the_deflection_of_the_contact_per_deflection_of_the_spring(data):  # (20)
    """At rest the same force goes through both: K_I (x_r1 - x_m) = k_s (x_m - x_0)."""
    plant = data.draw(plants(CONTACT_LAWS[LinearSpring]()))
    compression = data.draw(between(1e-3, 0.1))
    force = plant.contact.force(plant.theta_dk * compression, 0.0)
    x_m = plant.body.x_0 + compression
    balance = plant.body.m * plant.body.acceleration(x_m, 0.0, force)
    assert balance == pytest.approx(0.0, abs=1e-11 * plant.body.k_s)


# Along motions: the fixed-step integrator


@functools.cache
def stepper(plant: Plant) -> ca.Function:
    """One step of the unforced plant, split at a switch: next state, energy and contact there."""
    column, dt = ca.SX.sym("column", PLANT.size), ca.SX.sym("dt")
    still = vector(0.0, 0.0)
    following = phases_of(plant, still).split_step(column, dt)
    touch = plant.touch(as_state(following))
    return build(
        "step",
        {"column": column, "dt": dt},
        {
            "following": following,
            "energy": plant.energy(as_state(following)),
            "rates": PLANT.pack(plant.rates(as_state(column), still)._asdict()),
            "contact": vector(touch.gap, touch.F_m),
        },
    )


def march(plant: Plant, start: PlantState, end: float, steps: int) -> dict[str, np.ndarray]:
    """States, energies, gaps and contact forces of an unforced run, the start included."""
    step = stepper(plant)
    x, energy, _, contact = step.mapaccum(steps)(as_column(start), end / steps)
    first = plant.touch(start)
    return {
        "x": np.hstack([as_column(start)[:, None], x.full()]),
        "energy": np.append(plant.energy(start), energy.full()),
        "gap": np.append(first.gap, contact.full()[0]),
        "F_m": np.append(first.F_m, contact.full()[1]),
    }


def started(plant: Plant, gap: float, q_dot: tuple[float, float], compression: float) -> PlantState:
    """State at rest but for the arm, with the tip at a gap from the mass."""
    x_m = plant.body.x_0 + compression
    q = plant.arm.inverse((x_m + gap, 0.4), "-")
    return PlantState(q, np.array(q_dot), x_m, 0.0, 0.0)


FREE = started(LOSSLESS, gap=-0.3, q_dot=(-2.0, 3.0), compression=0.02)
PRESSED = started(LOSSLESS, gap=1.5e-3, q_dot=(0.1, -0.2), compression=0.04)
SMOOTH = pytest.mark.parametrize(
    ("start", "end", "steps"),
    [(FREE, 0.5, (64, 128, 256)), (PRESSED, 0.08, (64, 128, 256))],
    ids=["free motion", "permanent contact"],
)


def orders(errors: list[float]) -> np.ndarray:
    """Order seen between each two runs of which the second has half the step."""
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


def in_one_mode(run: dict[str, np.ndarray], start: PlantState) -> bool:
    return bool(np.all((run["gap"] >= 0) == (run["gap"][0] >= 0)))


@SMOOTH
def test_the_step_converges_with_order_5_to_a_tightly_integrated_run(start, end, steps):
    rates = stepper(LOSSLESS)
    reference = solve_ivp(
        lambda t, x: rates(x, 0.0)[2].full()[:, 0],
        (0.0, end),
        as_column(start),
        method="DOP853",
        rtol=1e-13,
        atol=1e-13,
    ).y[:, -1]
    runs = [march(LOSSLESS, start, end, n) for n in steps]
    assert all(in_one_mode(run, start) for run in runs)
    errors = [float(np.abs(run["x"][:, -1] - reference).max()) for run in runs]
    assert orders(errors)[-1] == pytest.approx(5.0, abs=0.3)


@SMOOTH
def test_the_unforced_lossless_plant_keeps_its_energy_to_the_order_of_the_step(start, end, steps):
    runs = [march(LOSSLESS, start, end, n) for n in steps]
    drifts = [float(np.abs(run["energy"] - run["energy"][0]).max()) for run in runs]
    assert (orders(drifts) > 4.7).all()
    assert drifts[-1] < 1e-9 * runs[-1]["energy"][0]


def test_through_impact_and_separation_the_energy_is_kept_to_the_same_order():
    """The kink of (7) costs nothing: no step goes over it."""
    start = started(LOSSLESS, gap=-0.01, q_dot=(-1.0, 1.0), compression=0.0)
    runs = [march(LOSSLESS, start, 0.2, n) for n in (200, 400, 800)]
    for run in runs:
        assert run["gap"][0] < 0 > run["gap"][-1]
        assert np.diff(run["gap"] >= 0).sum() == 4  # two touches, two separations
    drifts = [float(np.abs(run["energy"] - run["energy"][0]).max()) for run in runs]
    assert (orders(drifts) > 4.7).all()
    assert drifts[-1] < 1e-9 * runs[-1]["energy"][0]


DISSIPATIVE = {
    "joint friction": Plant(
        TwoLinkArm(0.35, 0.3, 3.4, 0.2, 0.24, viscous=(0.5, 0.2), coulomb=(0.5, 0.1)),
        BODY,
        LinearSpring(K_I=2e4),
    ),
    "damped mass": Plant(ARM, MassSpring(1.5, 600.0, 0.2, damping=8.0), LinearSpring(K_I=2e4)),
    "Kelvin-Voigt": Plant(ARM, BODY, KelvinVoigt(K_I=2e4, damping=40.0)),
    "Hunt-Crossley": Plant(ARM, BODY, HuntCrossley(K_I=2e5, exponent=1.5, dissipation=0.5)),
}


@pytest.mark.parametrize("losing", list(DISSIPATIVE))
def test_with_damping_or_friction_the_energy_never_grows(losing):
    plant = DISSIPATIVE[losing]
    start = started(plant, gap=-0.01, q_dot=(-1.0, 1.0), compression=0.0)
    coarse, fine = (march(plant, start, 0.2, n)["energy"] for n in (500, 2000))
    integration_error = np.abs(coarse - fine[::4]).max()
    growth = np.maximum.accumulate(fine[::-1])[::-1] - fine  # later energy above the present one
    assert growth.max() <= integration_error < 1e-7 * fine[0]
    assert fine[-1] < 0.99 * fine[0]


def test_with_tip_friction_the_energy_grows_by_no_more_than_rising_pressure_can_free():
    """Bound of test_tip_friction: half mu times deflection times all rises of F_m together."""
    friction = TipFriction(mu=0.5, deflection=2e-4, damping=1e-3)
    plant = Plant(ARM, BODY, LinearSpring(K_I=2e4), friction)
    start = started(plant, gap=-0.01, q_dot=(-1.0, 1.0), compression=0.0)
    coarse, run = (march(plant, start, 0.2, n) for n in (5000, 20000))
    integration_error = np.abs(coarse["energy"] - run["energy"][::4]).max()
    rises = np.clip(np.diff(run["F_m"]), 0.0, None).cumsum()
    freed = friction.mu * friction.deflection / 2 * np.append(0.0, rises)
    assert (run["energy"] <= run["energy"][0] + freed + integration_error).all()
    assert integration_error < 1e-4 * run["energy"][0] < freed[-1]
    assert run["energy"][-1] < 0.99 * run["energy"][0]


def test_a_pressed_arm_sticks_to_the_body_where_a_smooth_tip_slides_off():
    """A constant torque presses the tip on the body and pulls it along X2, 60 % of break-away."""
    friction = TipFriction(mu=0.4, deflection=1e-4)
    damped = TwoLinkArm(0.35, 0.3, 3.4, 0.2, 0.24, viscous=(20.0, 5.0))
    body = MassSpring(1.5, 600.0, 0.2, damping=30.0)
    pressing = 600.0 * 0.03
    along = 0.6 * friction.breakaway * friction.mu * pressing

    def final_tip(mu_on: bool) -> np.ndarray:
        plant = Plant(damped, body, LinearSpring(K_I=2e4), friction if mu_on else TipFriction())
        start = started(plant, gap=pressing / 2e4, q_dot=(0.0, 0.0), compression=0.03)
        tau = plant.arm.J(start.q).T @ np.array([pressing, along])
        column = ca.SX.sym("column", PLANT.size)
        rates = build(
            "rates",
            {"column": column},
            {"rates": PLANT.pack(plant.rates(as_state(column), tau)._asdict())},
        )
        run = solve_ivp(
            lambda t, x: rates(x).full()[:, 0],
            (0.0, 20.0),
            as_column(start),
            method="LSODA",
            rtol=1e-9,
            atol=1e-12,
            t_eval=[0.0, 10.0, 20.0],
        )
        return np.array([plant.arm.x_r(x[:2])[1] for x in run.y.T])

    sticking, sliding = final_tip(True), final_tip(False)
    assert abs(sticking[2] - sticking[1]) < 1e-9  # [m] in the last 10 s: no creep
    assert abs(sticking[2] - sticking[0]) < friction.deflection
    assert abs(sliding[2] - sliding[0]) > 100 * friction.deflection
