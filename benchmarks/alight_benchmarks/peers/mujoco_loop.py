"""MuJoCo: its multibody dynamics, its soft contact and its integrators.

The arm, the mass and a frictionless contact pair are MuJoCo's own. A contact of MuJoCo is a soft
constraint, not a spring: with impedance ``d`` it gives ``F = d/(1-d) (a_ref - a)/A``, where ``A``
is MuJoCo's estimate of the inverse inertia at the contact and ``a`` the relative acceleration
there. With ``a_ref = k penetration / d``, what a negative ``solref`` states, the force tends to
``k/A penetration`` as ``d`` vanishes. So ``k = K_I A`` and the smallest ``d`` that MuJoCo allows,
1e-4, make the spring (7) but for a few parts in ten thousand.

Two integrators: Runge-Kutta, which MuJoCo has for motion that must keep its energy, and Euler, its
default, at the same step. Tolerances: under Runge-Kutta that softness decides (doubling ``d`` moves
the first 0.3 s by 6e-5, steps four times shorter by 3e-6), under Euler its step (halving it moves
them by 3e-3, so that 6e-3 is to be expected).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from alight_benchmarks.equations import (
    Measured,
    initial_law_state,
    law_flow,
    law_step,
    with_arrays,
)
from alight_benchmarks.peer import RECORD_EVERY, Numbers, Peer, Problem, Run

IMPEDANCE = 1e-4
RADIUS = 0.05
"""Of the ball at the tip [m]; any that is larger than the penetration."""
EULER = "Euler"
RK4 = "RK4"

SampledLaw = Callable[[np.ndarray, np.ndarray], Any]
"""Torques from the positions ``(q1, q2, x_m)`` and their rates; it keeps its own state."""


# Model


def mjcf(n: Numbers, timestep: float, integrator: str) -> str:
    """Model whose links have the inertia of ``p1``, ``p2`` and ``p3``.

    These leave the mass of a link and its place open: the second link has its centre of mass half
    way, the first turns about its own.
    """
    l_c2 = n.l2 / 2
    m2 = n.p3 / (n.l1 * l_c2)
    spin2 = n.p2 - m2 * l_c2**2
    spin1 = n.p1 - n.p2 - m2 * n.l1**2
    limit1, limit2 = n.tau_max
    return f"""
<mujoco>
  <compiler angle="radian"/>
  <option timestep="{timestep}" gravity="0 0 0" integrator="{integrator}"/>
  <worldbody>
    <body name="link1">
      <inertial pos="0 0 0" mass="1" diaginertia="{spin1} {spin1} {spin1}"/>
      <joint name="q1" type="hinge" axis="0 0 1"/>
      <body name="link2" pos="{n.l1} 0 0">
        <inertial pos="{l_c2} 0 0" mass="{m2}" diaginertia="{spin2} {spin2} {spin2}"/>
        <joint name="q2" type="hinge" axis="0 0 1"/>
        <geom name="tip" type="sphere" size="{RADIUS}" pos="{n.l2} 0 0"/>
      </body>
    </body>
    <body name="mass" pos="{n.x_0} 0 0">
      <inertial pos="0 0 0" mass="{n.m}" diaginertia="1 1 1"/>
      <joint name="x_m" type="slide" axis="1 0 0" stiffness="{n.k_s}"/>
      <geom name="face" type="box" size="0.1 1 1" pos="{0.1 + RADIUS} 0 0"/>
    </body>
  </worldbody>
  <contact>
    <pair name="impact" geom1="tip" geom2="face" condim="1"
          solimp="{IMPEDANCE} {IMPEDANCE} 1 0.5 1" solref="-1 0"/>
  </contact>
  <actuator>
    <motor joint="q1" ctrlrange="{-limit1} {limit1}"/>
    <motor joint="q2" ctrlrange="{-limit2} {limit2}"/>
  </actuator>
</mujoco>"""


def build_model(problem: Problem, integrator: str) -> Any:
    """Compile the model and give its contact the stiffness ``K_I``."""
    import mujoco

    n = problem.numbers
    step = 1 / (problem.sample_rate * problem.substeps)
    model = mujoco.MjModel.from_xml_string(mjcf(n, step, integrator))
    touching = [model.body(name).id for name in ("link2", "mass")]
    inverse_inertia = model.body_invweight0[touching, 0].sum()
    model.pair_solref[0] = [-n.K_I * inverse_inertia, 0.0]
    return model


# Law


def numpy_law(problem: Problem) -> Callable[[], SampledLaw]:
    """Law in NumPy."""
    n, dt = with_arrays(problem.numbers, np), 1 / problem.sample_rate

    def start() -> SampledLaw:
        state = initial_law_state(n, np)

        def law(at: np.ndarray, rate: np.ndarray) -> Any:
            nonlocal state
            flow = law_flow(np, n, Measured(at[0], at[1], rate[0], rate[1], at[2], rate[2]), state)
            state = law_step(np, n, state, flow.rates, dt)
            return flow.tau1, flow.tau2

        return law

    return start


def compiled_law(problem: Problem) -> Callable[[], SampledLaw]:
    """Law as C that CasADi generates, called through its buffers."""
    import casadi as ca

    from alight import Measurement
    from alight.symbolic.build import build
    from alight_benchmarks.generated import compiled

    scenario = problem.scenario
    layout = scenario.closed_loop.law_layout
    at, rate, memory = ca.SX.sym("at", 3), ca.SX.sym("rate", 3), ca.SX.sym("law", layout.size)
    measured = Measurement(at[:2], rate[:2], at[2], rate[2])
    done = scenario.law.tick(layout.unpack(memory), measured, 1 / problem.sample_rate)
    function = build(
        "law",
        {"at": at, "rate": rate, "law": memory},
        {"tau": done.tau, "law_next": layout.pack(dict(done.state))},
    )
    tick = compiled(function)
    initial = layout.pack(dict(scenario.law.initial_state()))

    def start() -> SampledLaw:
        memory = initial

        def law(at: np.ndarray, rate: np.ndarray) -> np.ndarray:
            nonlocal memory
            tau, memory = tick(at, rate, memory)
            return tau

        return law

    return start


# Runs


def closed_loop(problem: Problem, model: Any, law: SampledLaw) -> tuple[np.ndarray, np.ndarray]:
    """Rows of ``[q1, q2, x_m]``, and the torque commanded at each sample."""
    import mujoco

    n, dt = problem.numbers, 1 / problem.sample_rate
    rest = np.array([0.0, 0.0, n.x_0])
    data = mujoco.MjData(model)
    data.qpos[:] = start_of(n)
    before = data.qpos + rest
    rows, torques = [], np.empty((problem.ticks, 2))
    for k in range(problem.ticks):
        at = data.qpos + rest
        if k % RECORD_EVERY == 0:
            rows.append(at)
        data.ctrl = torques[k] = law(at, (at - before) / dt)
        before = at
        mujoco.mj_step(model, data, nstep=problem.substeps)
    return np.array(rows), torques


def start_of(n: Numbers) -> list[float]:
    """Positions of the joints at the start."""
    return [*n.q0, n.x_m0 - n.x_0]


def _prepare(
    problem: Problem, *, integrator: str, law_of: Callable[[Problem], Callable[[], SampledLaw]]
) -> Run:
    model, start = build_model(problem, integrator), law_of(problem)
    return lambda: closed_loop(problem, model, start())[0]


def _prepare_steps(problem: Problem, *, integrator: str) -> Run:
    import mujoco
    from mujoco import rollout

    model = build_model(problem, integrator)
    data = mujoco.MjData(model)
    _, torques = closed_loop(problem, model, numpy_law(problem)())
    controls = np.repeat(torques, problem.substeps, axis=0)[None]
    n = problem.numbers
    initial = np.array([[0.0, *start_of(n), 0.0, 0.0, 0.0]])  # time, positions, velocities
    states = np.empty((1, controls.shape[1], initial.shape[1]))

    def run() -> np.ndarray:
        rollout.rollout(model, data, initial, controls, state=states)
        every = RECORD_EVERY * problem.substeps
        rows = np.concatenate([initial, states[0, every - 1 :: every]])[: len(problem.times), 1:4]
        return rows + [0.0, 0.0, n.x_0]

    return run


TOLERANCE = {RK4: 1e-4, EULER: 1e-2}


def _loop(language: str, law_of: Callable[[Problem], Any], integrator: str) -> Peer:
    return Peer(
        name=f"MuJoCo {integrator}, law in {language}",
        package="mujoco",
        how=f"mj_step ({integrator}, 4 steps a sample, its own contact) in a Python loop, "
        f"law in {language}",
        prepare=partial(_prepare, integrator=integrator, law_of=law_of),
        tolerance=TOLERANCE[integrator],
    )


def _steps(integrator: str) -> Peer:
    return Peer(
        name=f"MuJoCo {integrator}, mj_step alone",
        package="mujoco",
        how=f"mj_step ({integrator}, 4 steps a sample, its own contact) looped in C by "
        "mujoco.rollout over the torques of an earlier closed loop",
        prepare=partial(_prepare_steps, integrator=integrator),
        tolerance=TOLERANCE[integrator],
    )


PEERS = (
    _loop("NumPy", numpy_law, RK4),
    _loop("C", compiled_law, RK4),
    _loop("C", compiled_law, EULER),
    _steps(RK4),
    _steps(EULER),
)
