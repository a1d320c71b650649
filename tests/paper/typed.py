"""What the typed equations of the paper are made of, without any of Alight's functions."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from alight.control import Estimate
from tests.control.cases import Case
from tests.control.closed_loop import evaluate


def agree(found: Any, *terms: Any, rounding: float = 1e-11) -> None:
    """The terms sum to ``found``, to rounding of the largest of them."""
    scale = sum(np.abs(term).max() for term in map(np.asarray, terms))
    np.testing.assert_allclose(found, sum(terms), rtol=0, atol=rounding * scale)


def scope(case: Case) -> SimpleNamespace:
    """The paper's symbols at a case.

    Parameters, gains and state stand as given; the rest is what Alight finds by differentiation.
    """
    law, plant = case.law, case.law.model
    body, gains = plant.body, law.gains
    return SimpleNamespace(
        **evaluate(case),
        case=case,
        m=body.m,
        k_s=body.k_s,
        K_I=plant.contact.K_I,
        x_0=body.x_0,
        x_md=law.target.x_md,
        x_rd2=law.target.x_rd2,
        k1=gains.k1,
        k2=gains.k2,
        k3=np.array(gains.k3),
        alpha1=gains.alpha1,
        alpha2=gains.alpha2,
        alpha3=gains.alpha3,
        alpha=np.diag(gains.alpha),
        Gamma=gains.Gamma,
        Gamma_r=np.array(law.Gamma_r),
        x_m=case.s.x_m,
        x_m_dot=case.s.x_m_dot,
        e_f=case.e_f,
        theta_r_hat=case.a.theta_r_hat,
    )


def projected(estimate: Estimate, mu: Any, theta_hat: Any) -> Any:
    """The scalar projection of [48] with one continuous derivative, entry by entry."""
    a, b = np.asarray(estimate.lower), np.asarray(estimate.upper)
    c, h = (a + b) / 2, (b - a) / 2
    epsilon, delta = estimate.margin * h, estimate.leak * h**2
    phi = theta_hat - c
    p = phi**2 - h**2
    pushed = phi * mu + np.sqrt((phi * mu) ** 2 + delta**2)
    rho = p / (epsilon**2 + 2 * epsilon * h)
    return np.where(p > 0, mu - rho**2 * phi * pushed / (2 * h**2), mu)[()]


def sech2(x: Any) -> Any:
    """``cosh^-2``."""
    return np.cosh(x) ** -2.0
