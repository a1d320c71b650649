"""The reference: the continuous closed loop by an adaptive solver, contact located as an event."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from alight.control.transition import FILTER_TRIP, ContactTransitionLaw
from alight.errors import AlightError
from alight.kernels.direct import Direct
from alight.models import PlantState
from alight.simulation.closed_loop import (
    PLANT,
    PLANT_SIGNALS,
    ClosedLoop,
    InitialState,
    plant_signals,
)
from alight.simulation.continuous import continuous_rates, join_state, split_state
from alight.simulation.recording import Recording
from alight.simulation.verdict import Outcome, Verdict
from alight.symbolic.build import build
from alight.symbolic.signals import Layout, Signal

FILTER_MARGIN = 1e-9
"""Distance of ``u_f`` from 1 at which a reference run ends."""
SWITCH_MARGIN = 1e-10
"""Force by which the guard of the contact must pass zero [N]: more than rounding."""


@dataclass(frozen=True)
class Reference:
    """A run of the continuous closed loop."""

    recording: Recording
    switches: np.ndarray
    """Times at which the contact began or ceased to press [s]."""


def reference(
    loop: ClosedLoop,
    start: InitialState,
    times: np.ndarray,
    *,
    rtol: float = 1e-9,
    atol: float = 1e-11,
    method: str = "LSODA",
) -> Reference:
    """Integrate the closed loop in continuous time, with perfect sensors.

    The integration stops and starts afresh at each instant at which the contact begins or ceases
    to press, and holds it so in between: no step straddles the kink of (7).

    Parameters
    ----------
    loop : ClosedLoop
        Its testbed gives the torque limits; sampling, sensors and delay are left out.
    start : InitialState
        Where the run starts.
    times : (n,) array
        Times of the samples [s], increasing, the first at or after 0, the last after 0.
    rtol, atol : float
        Tolerances of the solver.
    method : str
        Method of `scipy.integrate.solve_ivp`. The projection makes the loop stiff where it acts.

    Raises
    ------
    AlightError
        If the law is not stated in continuous time, or the times are not as above.
    """
    times = _checked(times)
    if not isinstance(loop.law, ContactTransitionLaw):
        raise AlightError(
            f"{type(loop.law).__name__} is a sampled law; the reference needs one that states its "
            "flow in continuous time (a subclass of ContactTransitionLaw)"
        )
    rates, observe, layout = _functions(loop, loop.law)
    plant = PlantState(np.array(start.q), np.array(start.q_dot), start.x_m, start.x_m_dot, 0.0)
    x = join_state(loop.law, plant, dict(loop.law.initial_state()))
    names = (*PLANT.columns, *Layout(loop.law.states).columns)
    solver = _Switching(rates, names, dict(rtol=rtol, atol=atol, method=method))
    states, verdict = solver.solve(x, times)
    seen = Direct(observe)
    samples = np.array([seen(x)[0] for x in states.T]).reshape(-1, layout.size)
    recording = Recording(times[: len(samples)], samples, layout, verdict)
    return Reference(recording, np.array(solver.switches))


def _checked(times: Any) -> np.ndarray:
    given = np.asarray(times, dtype=float)
    rising = given.ndim == 1 and given.size and bool((np.diff(given) > 0).all())
    if not rising or not np.isfinite(given).all() or given[0] < 0 or given[-1] == 0:
        raise AlightError(
            "times must be one row of finite numbers that increase from 0 or later, to beyond 0"
        )
    return given


def _functions(
    loop: ClosedLoop, law: ContactTransitionLaw
) -> tuple[ca.Function, ca.Function, Layout]:
    column, pressing = ca.SX.sym("x", state_size(law)), ca.SX.sym("pressing")
    moving, signals = continuous_rates(loop.plant, law, column, loop.testbed.motors, pressing)
    s, memory = split_state(law, column)
    values = {**plant_signals(loop, s, signals["tau_applied"]), **memory, **signals}
    known = {**PLANT_SIGNALS, **law.signals, **law.states, "tau": Signal("N m", "torque", 2)}
    layout = Layout({name: known[name] for name in known if name in values})
    rates = build(
        "rates",
        {"x": column, "pressing": pressing},
        {"x_dot": moving, "guard": loop.plant.touch(s).guard},
    )
    return rates, build("observe", {"x": column}, {"y": layout.pack(values)}), layout


def state_size(law: ContactTransitionLaw) -> int:
    """Number of states of the continuous closed loop."""
    return PLANT.size + Layout(law.states).size


class _Switching:
    """Integrates from one change of contact to the next."""

    def __init__(self, rates: ca.Function, names: tuple[str, ...], options: dict[str, Any]) -> None:
        self._rates, self._names, self._options = Direct(rates), names, options
        self._u_f = names.index("u_f")
        self.switches: list[float] = []

    def _guard(self, x: np.ndarray) -> float:
        return float(self._rates(x, 0.0)[1][0])

    def _events(self, pressing: bool) -> list[Any]:
        # a phase begins beyond the surface, so that the way back is seen however short it is
        late = SWITCH_MARGIN if pressing else -SWITCH_MARGIN

        def guard(_: float, x: np.ndarray) -> float:
            return self._guard(x) + late

        def margin(_: float, x: np.ndarray) -> float:
            return float(1 - FILTER_MARGIN - abs(x[self._u_f]))

        guard.direction = -1 if pressing else 1  # type: ignore[attr-defined]
        guard.terminal = margin.terminal = True  # type: ignore[attr-defined]
        return [guard, margin]

    def solve(self, x: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, Verdict]:
        """States at the given times, one column each, and how the run ended."""
        from scipy.integrate import solve_ivp  # a third of a second, which an import need not cost

        columns: list[np.ndarray] = []
        t, end = 0.0, float(times[-1])
        pressing = self._guard(x) >= 0
        while True:
            inside = times[(times > t) | ((times >= t) & (not columns))]
            # a trial step may leave the domain of u_f and overflow; it is then made shorter
            with np.errstate(over="ignore", invalid="ignore"):
                part = solve_ivp(
                    lambda _, at, pressing=pressing: self._rates(at, pressing)[0],
                    (t, end),
                    x,
                    t_eval=inside,
                    events=self._events(pressing),
                    **self._options,
                )
            columns.append(np.reshape(part.y, (len(x), len(part.t))))
            if not np.isfinite(part.y).all():
                cause = "the solver stepped over a state that is no number"
                return np.hstack(columns), Verdict(Outcome.NOT_FINITE, end, None, cause)
            if part.status == 0:
                return np.hstack(columns), Verdict(Outcome.COMPLETED, end)
            if part.status < 0:
                last = float(part.t[-1]) if len(part.t) else t
                return np.hstack(columns), Verdict(Outcome.DIVERGED, last, None, part.message)
            if part.t_events[1].size:
                last, cause = float(part.t_events[1][0]), ContactTransitionLaw.trips[FILTER_TRIP]
                return np.hstack(columns), Verdict(Outcome.TRIPPED, last, "u_f", cause)
            pressing = not pressing
            t, x = float(part.t_events[0][0]), part.y_events[0][0]
            self.switches.append(t)
