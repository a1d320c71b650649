"""Where the printed and the corrected reading of Theorem 1 differ; all else they share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from alight.control import Estimate
from alight.control.error_system import cosh2_tanh
from alight.theory.theorem_1.design import Design


class Formulas(ABC):
    """One reading of the constants and conditions of Theorem 1."""

    inside: ClassVar[float]
    """Square of the factor before ``atanh`` in (61)."""
    statements: ClassVar[Mapping[str, str]]
    """The conditions that differ, in symbols, by number."""
    notes: ClassVar[Mapping[str, str]]
    """What to know of this reading of a condition or constant, by number or symbol."""

    @abstractmethod
    def lambda_1(self, d: Design) -> float:
        """Weight of the state in the bound (48) of ``V`` [J], (49)."""

    @abstractmethod
    def zeta_theta(self, d: Design) -> float:
        """Part of the parameter errors in the bound (48) of ``V`` [J], (49)."""

    @abstractmethod
    def V_start(self, d: Design) -> float:
        """Bound of ``V(0)`` that (59) takes [J]."""

    @abstractmethod
    def epsilon_x(self, d: Design) -> float:
        """What free motion can add to ``V_dot`` at most [W], after (55)."""

    @abstractmethod
    def alpha_of_contact(self, d: Design) -> float:
        """The ``alpha`` of (38) [1/s]."""

    @abstractmethod
    def axes(self, d: Design) -> tuple[tuple[float, float], ...]:
        """Pairs ``k3`` [N], ``alpha`` [1/s] for which (39) is asked."""

    @abstractmethod
    def spread(self, u_f: float) -> float:
        """Factor of ``k1 k2`` in (67), at ``u_f = tanh(epsilon_f)``."""

    @abstractmethod
    def hindrance(self, d: Design, e_m: float) -> float:
        """How far ``Y_d theta_dk_hat`` can hold the desired position back at most [m], (67)."""


class Printed(Formulas):
    """The conditions as printed, with the bars that the proof needs (erratum E8)."""

    inside = 5.0
    statements: ClassVar[Mapping[str, str]] = {
        "(26)": "k1 = (3 + k_n1 zeta_1^2) / m_l for a k_n1 of (37)",
        "(38), first": "alpha2 > zeta_K_upper^2 / (4 alpha)",
        "(38), second": "alpha2 > zeta_K_upper^2 zeta_xm^2 / lambda",
        "(59)": "k3 alpha > (sqrt(2 (lambda_1 |z_bar(0)|^2 + zeta_theta) / a1) + 1)^2",
        "(62)": (
            "k3 alpha > (sqrt(2 (5 lambda_1 atanh(sqrt(eps_x / lambda))^2 + zeta_theta) / a1)"
            " + 1)^2"
        ),
        "(39)": "k3 alpha > (sqrt(2 V_u / a1) + 1)^2",
        "(67)": (
            "k2 (tanh(e_m) - k1 cosh(eps_f)^2) >= eps_f - x_md theta_dk_lower"
            " + (e_m + x_0) theta_dk_upper at e_m = x_md - x_0"
        ),
        "(69)": (
            "k2 (tanh(eps_m) - k1 cosh(eps_f)^2) >= eps_f - x_md theta_dk_lower"
            " + (eps_m_upper + x_0) theta_dk_upper"
        ),
        "(70), k1": "k1 < tanh(eps_m) / cosh(eps_f)^2",
        "(70), k2": (
            "k2 >= (eps_f - x_md theta_dk_lower + (eps_m_upper + x_0) theta_dk_upper)"
            " / (tanh(eps_m) - k1 cosh(eps_f)^2)"
        ),
    }
    notes: ClassVar[Mapping[str, str]] = {
        "lambda_1": "Printed with 1 for e_r, where 3/2 is needed: too small where it decides (E5).",
        "zeta_theta": (
            "Printed with the bound of theta_dk_hat itself (E6), the largest entry of "
            "Gamma_r^-1 for all of them (E7), and boxes that the estimates do not leave (E22)."
        ),
        "eps_x": "Printed with zeta_xm alone: a bound only where zeta_xr >= -zeta_xm (E9).",
        "|z_bar|": "The factor sqrt(5) is not needed (E11).",
        "lambda": "The paper never says what lambda is (E10); the scalar gains are the least ones.",
        "(38), first": "The scalar alpha is the least entry of the diagonal.",
        "(59)": "The scalars k3 and alpha are the least entries of the diagonals.",
        "(62)": "The scalars k3 and alpha are the least entries of the diagonals.",
        "(39)": "The scalars k3 and alpha are the least entries of the diagonals.",
        "(67)": "It depends on where the coordinates begin (E16), and drops tanh(eps_f) (E15).",
        "(69)": "It depends on where the coordinates begin (E16), and drops tanh(eps_f) (E15).",
        "(70), k1": "Dropping tanh(eps_f) is what keeps k1 below tanh(eps_m) (E15).",
        "(70), k2": "It depends on where the coordinates begin (E16), and drops tanh(eps_f) (E15).",
    }

    def lambda_1(self, d: Design) -> float:  # noqa: D102
        b = d.bounds
        return max(d.inertia.a2 / 2, 1.0, b.m_u / 2, d.gains.k2 * b.zeta_K[1])

    def zeta_theta(self, d: Design) -> float:  # noqa: D102
        compliance = np.abs(_ends(d.theta_dk)).max()
        lower, upper = _ends(d.theta_r)
        learning = np.sum((upper - lower) ** 2) / min(d.Gamma_r)
        return float(d.bounds.zeta_K[1] * compliance**2 / d.gains.Gamma + learning) / 2

    def V_start(self, d: Design) -> float:  # noqa: D102
        return self.lambda_1(d) * d.z_bar**2 + self.zeta_theta(d)

    def epsilon_x(self, d: Design) -> float:  # noqa: D102
        return (d.bounds.zeta_K[1] * d.bounds.zeta_xm) ** 2 / d.gains.alpha2

    def alpha_of_contact(self, d: Design) -> float:  # noqa: D102
        return min(d.gains.alpha)

    def axes(self, d: Design) -> tuple[tuple[float, float], ...]:  # noqa: D102
        return ((min(d.gains.k3), min(d.gains.alpha)),)

    def spread(self, u_f: float) -> float:  # noqa: D102
        return 1 / (1 - u_f**2)

    def hindrance(self, d: Design, e_m: float) -> float:  # noqa: D102
        lower, upper = _ends(d.theta_dk)
        return float(-d.x_md * lower + (e_m + d.x_0) * upper)


class Corrected(Formulas):
    """The same conditions with the errata mended, their structure kept."""

    inside = 1.0
    statements: ClassVar[Mapping[str, str]] = {
        "(26)": "k1 >= (3 + k_n1 zeta_1^2) / m_l for a k_n1 of (37)",
        "(38), first": "alpha2 > zeta_K_upper^2 / (4 alpha_1)",
        "(38), second": "alpha2 > zeta_K_upper^2 (zeta_xm - zeta_xr)^2 / (4 lambda)",
        "(59)": "k3_i alpha_i > (sqrt(2 V(0) / a1) + 1)^2, i = 1, 2",
        "(62)": (
            "k3_i alpha_i > (sqrt(2 (lambda_1 atanh(sqrt(eps_x / lambda))^2 + zeta_theta) / a1)"
            " + 1)^2, i = 1, 2"
        ),
        "(39)": "k3_i alpha_i > (sqrt(2 V_u / a1) + 1)^2, i = 1, 2",
        "(67)": "k2 (tanh(e_m) - k1 sinh(eps_f) cosh(eps_f)) >= eps_f at e_m = x_md - x_0",
        "(69)": (
            "k2 (tanh(eps_m) - k1 sinh(eps_f) cosh(eps_f)) >= eps_f"
            " + max(0, eps_m_upper + x_0 - x_md) theta_dk_upper"
        ),
        "(70), k1": "k1 sinh(eps_f) cosh(eps_f) < tanh(eps_m)",
        "(70), k2": (
            "k2 >= (eps_f + max(0, eps_m_upper + x_0 - x_md) theta_dk_upper)"
            " / (tanh(eps_m) - k1 sinh(eps_f) cosh(eps_f))"
        ),
    }
    notes: ClassVar[Mapping[str, str]] = {
        "lambda_1": "With 3/2 for e_r and half the printed k2 zeta_K_upper (E5).",
        "zeta_theta": (
            "Each entry with its own adaptation gain (E7); an estimate may leave its box by the "
            "layer of the projection (E22)."
        ),
        "eps_x": "With zeta_xm - zeta_xr, and the 1/4 of completing the square (E9).",
        "|z_bar|": "Without sqrt(5): atanh(sqrt(v))^2 is convex, and 0 at 0 (E11).",
        "lambda": "The largest solution of what the paper leaves circular (E10), axis by axis.",
        "V(0)": "V itself at the start, at the worst truth within the bounds.",
        "V_u": "From V(0) itself, and without the factor 5 (E11).",
        "(38), first": "Only e_r1 meets eta_m: alpha is that of the axis X1.",
        "(59)": "From V(0) itself, axis by axis.",
        "(62)": "Without the factor 5 (E11), axis by axis.",
        "(39)": "Axis by axis, with the largest lambda that is consistent with V_u (E10).",
        "(67)": "A mass at rest does not hold the desired position back (E16): this is (66).",
        "(69)": "Free of the origin of the coordinates (E16), tanh(eps_f) kept (E15).",
        "(70), k1": "tanh(eps_f) is kept (E15).",
        "(70), k2": "Free of the origin of the coordinates (E16), tanh(eps_f) kept (E15).",
    }

    def lambda_1(self, d: Design) -> float:  # noqa: D102
        b = d.bounds
        return max(d.inertia.a2 / 2, 1.5, b.m_u / 2, d.gains.k2 * b.zeta_K[1] / 2)

    def zeta_theta(self, d: Design) -> float:  # noqa: D102
        compliance = d.theta_dk.widened[1] - _ends(d.theta_dk)[0]
        error = d.theta_r.widened[1] - _ends(d.theta_r)[0]
        learning = np.sum(error**2 / np.array(d.Gamma_r))
        return float(d.bounds.zeta_K[1] * compliance**2 / d.gains.Gamma + learning) / 2

    def V_start(self, d: Design) -> float:  # noqa: D102
        return d.V_0

    def epsilon_x(self, d: Design) -> float:  # noqa: D102
        b = d.bounds
        return (b.zeta_K[1] * (b.zeta_xm - b.zeta_xr)) ** 2 / (4 * d.gains.alpha2)

    def alpha_of_contact(self, d: Design) -> float:  # noqa: D102
        return d.gains.alpha[0]

    def axes(self, d: Design) -> tuple[tuple[float, float], ...]:  # noqa: D102
        return tuple(zip(d.gains.k3, d.gains.alpha, strict=True))

    def spread(self, u_f: float) -> float:  # noqa: D102
        return float(cosh2_tanh(u_f))

    def hindrance(self, d: Design, e_m: float) -> float:  # noqa: D102
        return max(0.0, e_m - d.e_m_rest) * float(max(d.theta_dk.widened[1], 0.0))


def _ends(estimate: Estimate) -> tuple[np.ndarray, np.ndarray]:
    """Bounds (28) or (34) as arrays."""
    return np.asarray(estimate.lower), np.asarray(estimate.upper)
