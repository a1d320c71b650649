"""The sampled loop, linearised at rest: plant discretised exactly, law as it ticks.

One sample takes the state to the next. The state holds

- the plant: ``q``, ``q_dot``, ``x_m``, ``x_m_dot`` (without tip friction the bristle rests);
- ``v``, the velocities that backward differences show the law now, in place of the readings that
  they remember: the same state in coordinates that do not grow as the sample time ``T`` shrinks;
- the law: ``u_f``, ``theta_dk_hat``, ``theta_r_hat``;
- the torque that is held back, where the testbed delays it by a sample.

Between two samples the torque is held, so that the plant ``x_dot = A x + B tau`` moves by
``A x + B tau`` times the integral of ``exp(A t)`` over ``T``; at a rest, linearisation and exact
discretisation commute. The sensors are ideal here: their rounding is a bounded disturbance, which
has no slope. The map is kept as ``(M - I) / T``, whose eigenvalues do not crowd at 1 for short
sample times.

``theta_r_hat`` acts through ``Y_r theta_r_hat`` alone and moves along ``Gamma_r Y_r^T r_r`` alone,
where ``r_r`` is zero at rest. With ``S = Gamma_r^(1/2) Y_r^T`` and an orthonormal basis of its
range, at most two coordinates of ``Gamma_r^(-1/2) theta_r_hat`` take part in the loop. Along all
others the estimate keeps its value whatever the state does: an eigenvalue of exactly 1 each, which
says nothing about stability. They are left out by this structure, not by a tolerance.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np

from alight.control import AdaptiveState
from alight.errors import AlightError
from alight.kernels.direct import Direct
from alight.models import Plant, PlantState
from alight.simulation.closed_loop import PLANT, SENSORS
from alight.symbolic.build import build
from alight.symbolic.ops import as_vector
from alight.symbolic.parameters import lift, rebind, values_of
from alight.symbolic.signals import Layout
from alight.testbed import Encoder, SensorState, Testbed, Transducer
from alight.theory.lyapunov import errors_at, ideal_measurement
from alight.theory.sampled.rest import Rest
from alight.theory.sampled.shape import Shape

MOVING = PLANT.size - 1
"""States of the plant without the bristle."""
READ = SENSORS.size
FREE_MASS = ("x_m", "x_m_dot", "v_x_m")


@dataclass(frozen=True)
class LinearLoop:
    """The linearised loop, for any sample time; states stand in the order of ``columns``."""

    rest: Rest
    plant: Callable[[float], tuple[np.ndarray, np.ndarray]]
    """Sample time to the mean rate of the plant over a sample, per state and per torque."""
    C: np.ndarray
    """Slope of the readings over the plant's state."""
    columns: tuple[str, ...]
    """Name of each entry of the state without a torque that is held back."""
    controller: Direct
    """Sample time to the slope of the law's torque and next state over that state."""
    basis: np.ndarray
    """Excited directions of ``theta_r_hat``: ``Gamma_r^(1/2)`` times a basis of the range of S."""
    dual: np.ndarray
    """What gives the coordinates of ``theta_r_hat`` along them."""

    @property
    def unexcited(self) -> int:
        """Directions of ``theta_r_hat`` that are left out."""
        return self.basis.shape[0] - self.basis.shape[1]

    def with_theta_r_held(self) -> LinearLoop:
        """The same loop with ``theta_r_hat`` held where it is, instead of adapted."""
        return dataclasses.replace(self, basis=self.basis[:, :0], dual=self.dual[:0])

    def slope(self, T: float, delay: bool) -> np.ndarray:
        """``(M - I) / T`` [1/s] of the whole state; ``delay`` holds torques back by a sample."""
        size = len(self.columns)
        drift, push = self.plant(T)
        law = self.controller(T)[0].reshape((-1, size), order="F")
        tau, memory = law[:2], law[2:]

        moving = np.zeros((MOVING + READ, size))
        moving[:, :MOVING] = np.vstack([drift, self.C @ drift / T])
        moving[MOVING:, MOVING : MOVING + READ] = -np.eye(READ) / T
        pushing = np.vstack([push, self.C @ push / T])
        learning = (memory - np.eye(size)[MOVING + READ :]) / T
        if not delay:
            return np.vstack([moving + pushing @ tau, learning])
        learning = np.hstack([learning, np.zeros((len(learning), 2))])
        held = np.hstack([tau, -np.eye(2)]) / T
        return np.vstack([np.hstack([moving, pushing]), learning, held])

    def judged(self, T: float, delay: bool) -> np.ndarray:
        """`slope` of what the law can make stable or unstable [1/s].

        In contact that is the whole loop but the unexcited directions of ``theta_r_hat``. In free
        motion no force acts on the mass: it moves as it does whatever arm and law do, and drives
        them, so that its eigenvalues stand apart. There ``theta_dk_hat`` is multiplied by
        ``Y_d = 0`` and acts on nothing: it is left out, too.
        """
        apart = (*FREE_MASS, "theta_dk_hat") if self.rest.phase == "free motion" else ()
        kept = [i for i, name in enumerate(self.columns) if name not in apart]
        estimates = len(self.columns) - self.basis.shape[0]
        into = np.eye(estimates)[:, [i for i in kept if i < estimates]]
        held = np.eye(2 if delay else 0)
        return (
            _blocks(into.T, self.dual, held)
            @ self.slope(T, delay)
            @ _blocks(into, self.basis, held)
        )

    def free_mass(self, T: float) -> np.ndarray:
        """`slope` of position and velocity of the mass in free motion [1/s]."""
        mass = [self.columns.index(name) for name in FREE_MASS[:2]]
        return self.plant(T)[0][np.ix_(mass, mass)]


def _blocks(*parts: np.ndarray) -> np.ndarray:
    """Block-diagonal matrix; parts may have no rows or no columns."""
    from scipy.linalg import block_diag

    return np.asarray(block_diag(*parts))


def linear_loop(rest: Rest, testbed: Testbed) -> LinearLoop:
    """Linearise a loop at rest, with the sensors of ``testbed`` ideal.

    Raises
    ------
    AlightError
        If the motors cannot give the torque of the rest.
    """
    if np.any(testbed.motors.clip(rest.tau) != rest.tau):
        needed = ", ".join(f"{tau:.3g}" for tau in rest.tau)
        raise AlightError(
            f"no rest in {rest.phase}: it needs joint torques of {needed} N m, which "
            "testbed.motors clips"
        )
    A, B, C = _plant_slopes(rest)
    basis, dual = _excited(rest)
    law = Layout(rest.law.states).columns
    shown = tuple(f"v_{name}" for name in SENSORS.columns)
    columns = (*PLANT.columns[:MOVING], *shown, *law)
    plant = discretised(A, B)
    return LinearLoop(rest, plant, C, columns, _controller(rest, testbed), basis, dual)


def discretised(A: np.ndarray, B: np.ndarray) -> Callable[[float], tuple[np.ndarray, np.ndarray]]:
    """``T`` to ``(x(T) - x) / T`` per entry of ``x`` and ``tau``: ``x_dot = A x + B tau``, held.

    Exact, by one matrix exponential; without cancellation however short the sample.
    """
    from scipy.linalg import expm  # a third of a second, which an import need not cost

    n = len(A)

    @functools.lru_cache(maxsize=256)  # a scan over T is repeated with and without delay
    def over_a_sample(T: float) -> tuple[np.ndarray, np.ndarray]:
        integral = expm(np.block([[A, np.eye(n)], [np.zeros((n, 2 * n))]]) * T)[:n, n:]
        return A @ integral / T, integral @ B / T

    return over_a_sample


def ideal(testbed: Testbed, T: float | ca.SX) -> Testbed:
    """The testbed with sensors that round nothing, sampled every ``T`` seconds."""
    exact = rebind(testbed, encoder=Encoder(counts=0.0), transducer=Transducer())
    return rebind(exact, sample_rate=1 / T)


def _plant_slopes(rest: Rest) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    function = _plant_function(rest.plant, rest.pressing)
    A, B, C = (np.asarray(v) for v in function(PLANT.pack(rest.s._asdict()), rest.tau))
    return A[:MOVING, :MOVING], B[:MOVING], C[:, :MOVING]


# Functions are kept: for other gains of the same law nothing has to be derived again.
@functools.lru_cache(maxsize=16)
def _plant_function(plant: Plant, pressing: float) -> ca.Function:
    """Slopes of the plant's rates and of its readings."""
    x, tau = ca.SX.sym("x", PLANT.size), ca.SX.sym("tau", 2)
    moving = plant.rates(PlantState(**PLANT.unpack(x)), tau, pressing)
    rates = PLANT.pack(moving._asdict())
    read = SENSORS.pack(
        ideal(Testbed(), 1.0).readings(PlantState(**PLANT.unpack(x)), 0.0)._asdict()
    )
    slopes = {"A": ca.jacobian(rates, x), "B": ca.jacobian(rates, tau), "C": ca.jacobian(read, x)}
    return build("slopes", {"x": x, "tau": tau}, slopes)


def _controller(rest: Rest, testbed: Testbed) -> Direct:
    """Build the slope of the law's tick, seen through ideal sensors, as a function of ``T``."""
    slope = _law_function(Shape.of(rest.law), testbed)
    memory = Layout(rest.law.states).pack(rest.a._asdict())
    at = np.concatenate([PLANT.pack(rest.s._asdict())[:MOVING], np.zeros(READ), memory])
    t = ca.MX.sym("T")
    matrix = ca.densify(slope(at, t, values_of(rest.law)))
    return Direct(ca.Function("at_rest", [t], [matrix]))


@functools.lru_cache(maxsize=16)
def _law_function(shape: Shape, testbed: Testbed) -> ca.Function:
    """Slope of torque and next state, from the state, the sample time and the law's numbers."""
    lifted, T = lift(shape.law), ca.SX.sym("T")
    layout = Layout(shape.law.states)
    x, v = ca.SX.sym("x", MOVING), ca.SX.sym("v", READ)
    memory = ca.SX.sym("memory", layout.size)
    bed = ideal(testbed, T)
    now = bed.readings(PlantState(**PLANT.unpack(ca.vertcat(x, 0.0))), 0.0)
    before = SENSORS.pack(now._asdict()) - T * v
    measured = bed.measure(now, SensorState(**SENSORS.unpack(before)))
    tick = lifted.obj.tick(layout.unpack(memory), measured, T)
    following = ca.vertcat(tick.tau, layout.pack(dict(tick.state)))
    state = ca.vertcat(x, v, memory)
    inputs = {"state": state, "T": T, "p": lifted.symbols}
    return build("slope", inputs, {"slope": ca.jacobian(following, state)})


def _excited(rest: Rest) -> tuple[np.ndarray, np.ndarray]:
    """Directions of ``theta_r_hat`` in the range of ``Gamma_r Y_r^T``, and their coordinates."""
    Y_r = _regressor(Shape.of(rest.law))
    at = [PLANT.pack(rest.s._asdict()), Layout(rest.law.states).pack(rest.a._asdict())]
    weight = np.sqrt(as_vector(rest.law.Gamma_r))[:, None]
    S = weight * np.asarray(Y_r(*at, values_of(rest.law))).T
    S = S[rest.excited]
    kept = np.zeros((len(weight), min(S.shape)))
    kept[rest.excited] = np.linalg.qr(S)[0]
    return weight * kept, (kept / weight).T


@functools.lru_cache(maxsize=16)
def _regressor(shape: Shape) -> ca.Function:
    """``Y_r`` of plant and law state, and the law's numbers."""
    lifted, layout = lift(shape.law), Layout(shape.law.states)
    x, memory = ca.SX.sym("x", PLANT.size), ca.SX.sym("memory", layout.size)
    s, a = PlantState(**PLANT.unpack(x)), AdaptiveState(**layout.unpack(memory))
    Y_r = lifted.obj.Y_r(ideal_measurement(s), errors_at(lifted.obj, s, a))
    return build("regressor", {"x": x, "memory": memory, "p": lifted.symbols}, {"Y_r": Y_r})
