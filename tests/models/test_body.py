"""The mass on its spring, (3) and (6)."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given

from alight.models import MassSpring
from alight.simulation.integrate import dormand_prince_step
from alight.symbolic.derive import time_derivative
from tests.strategies import between, bodies

POSITIONS = between(-0.5, 0.5)
SPEEDS = between(-3.0, 3.0)


@given(bodies(), POSITIONS, SPEEDS, between(0.0, 500.0))
def test_newtons_law_of_the_mass(body, x_m, x_m_dot, F_m):  # (6)
    inertial = body.m * body.acceleration(x_m, x_m_dot, F_m)
    resisting = body.k_s * (x_m - body.x_0) + body.damping * x_m_dot
    assert inertial + resisting == pytest.approx(F_m, abs=1e-11 * (1 + F_m + abs(resisting)))


@given(bodies())
def test_the_undisturbed_mass_rests_at_x_0_without_energy(body):  # (3)
    assert body.acceleration(body.x_0, 0.0, 0.0) == 0
    assert body.energy(body.x_0, 0.0) == 0
    assert body.Y_d(body.x_0) == 0


@given(bodies(), POSITIONS, SPEEDS, between(0.0, 500.0))
def test_energy_changes_by_the_power_of_the_impact_force_less_the_damping(body, x, v, F_m):
    rate = time_derivative(body.energy, [x, v], [v, body.acceleration(x, v, F_m)])
    power = F_m * v - body.damping * v**2
    scale = 1 + abs(F_m * v) + body.k_s * abs(body.Y_d(x) * v) + body.damping * v**2
    assert rate == pytest.approx(power, abs=1e-12 * scale)
    assert body.energy(x, v) >= 0


@given(bodies(), POSITIONS, SPEEDS)
def test_the_free_mass_swings_with_its_natural_frequency_and_decay(body, x, v):
    """Against the closed solution of the damped oscillator, over one radian of the motion."""
    decay, stiffness = body.damping / (2 * body.m), body.k_s / body.m
    modes = np.roots([1.0, 2 * decay, stiffness])
    if abs(modes[0] - modes[1]) < 1e-3 * abs(modes[0]):  # near the double root the form degenerates
        return
    weights = np.linalg.solve(np.array([[1, 1], modes]), [x - body.x_0, v])
    steps, end = 400, 1 / np.abs(modes).max()

    def rates(state: np.ndarray) -> np.ndarray:
        return np.array([state[1], body.acceleration(state[0], state[1], 0.0)])

    state = np.array([x, v])
    for _ in range(steps):
        state = dormand_prince_step(rates, state, end / steps)
    expected = body.x_0 + (weights * np.exp(modes * end)).sum().real
    assert state[0] == pytest.approx(expected, abs=1e-9 * (1 + np.abs(weights).max()))


def test_a_mass_without_mass_or_spring_is_refused():
    for wrong in ({"m": 0.0}, {"m": -1.0}, {"k_s": 0.0}, {"damping": -1.0}):
        name, value = next(iter(wrong.items()))
        with pytest.raises(ValueError, match=f"{name} = {value}"):
            MassSpring(**{"m": 1.0, "k_s": 100.0, "x_0": 0.0, **wrong})
