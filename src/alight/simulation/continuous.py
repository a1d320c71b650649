"""The closed loop in continuous time: plant and law with perfect sensors and no sampling."""

from __future__ import annotations

from typing import Any

from alight.control.measurement import Measurement
from alight.control.transition import ContactTransitionLaw
from alight.models import Plant, PlantState
from alight.simulation.closed_loop import PLANT
from alight.symbolic.ops import Scalar, concatenate
from alight.symbolic.signals import Layout
from alight.testbed import Motors


def split_state(law: ContactTransitionLaw, column: Any) -> tuple[PlantState, dict[str, Any]]:
    """State of the plant and of the law from one column."""
    plant, memory = column[: PLANT.size], column[PLANT.size :]
    return PlantState(**PLANT.unpack(plant)), Layout(law.states).unpack(memory)


def join_state(law: ContactTransitionLaw, s: PlantState, memory: dict[str, Any]) -> Any:
    """One column from the state of the plant and of the law."""
    return concatenate(PLANT.pack(s._asdict()), Layout(law.states).pack(memory))


def continuous_rates(
    plant: Plant,
    law: ContactTransitionLaw,
    column: Any,
    motors: Motors | None = None,
    pressing: Scalar | None = None,
) -> tuple[Any, dict[str, Any]]:
    """Rate of the state of the continuous closed loop, and the law's signals.

    The law is (32) or (44) with (18), (27) and (33) as the paper states them, without sampling;
    ``motors`` clip the torque if given; ``pressing`` holds the contact as in `Plant.rates`.
    """
    s, memory = split_state(law, column)
    flow = law.flow(memory, Measurement(s.q, s.q_dot, s.x_m, s.x_m_dot))
    tau = flow.tau if motors is None else motors.clip(flow.tau)
    rates = join_state(law, plant.rates(s, tau, pressing), dict(flow.rates))
    return rates, {**flow.signals, "tau": flow.tau, "tau_applied": tau}
