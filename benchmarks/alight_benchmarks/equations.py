"""The closed loop typed by hand, for peers that compute with arrays.

It shares nothing with Alight's own equations but the paper: that both give the same trajectory is
a check of both. Functions take an array namespace ``xp`` (``numpy`` or ``jax.numpy``). Every scalar
may as well be an array over a batch of runs; vectors stand along the first axis. Numbers in the
docstrings are those of the paper's equations.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

from alight_benchmarks.peer import Box, Numbers

Array = Any


class Measured(NamedTuple):
    """What the law sees."""

    q1: Array
    q2: Array
    q1_dot: Array
    q2_dot: Array
    x_m: Array
    x_m_dot: Array


class LawState(NamedTuple):
    """Filter tanh(e_f) and the estimates of theta_dk and theta_r."""

    u_f: Array
    theta_dk: Array
    theta_r: Array


class Flow(NamedTuple):
    """Torque, and the rates of the law's state."""

    tau1: Array
    tau2: Array
    rates: LawState


def with_arrays(n: Numbers, xp: Any, *, batched: bool = False) -> Numbers:
    """Return the numbers with those of theta_r as columns that broadcast over a batch."""

    def column(values: Any) -> Array:
        array = xp.asarray(values)
        return array[:, None] if batched else array

    box = n.theta_r
    columns = {name: column(getattr(box, name)) for name in ("initial", "lower", "upper")}
    return replace(n, Gamma_r=column(n.Gamma_r), theta_r=replace(box, **columns))


def initial_law_state(n: Numbers, xp: Any) -> LawState:
    """Start of filter and estimates."""
    return LawState(xp.tanh(n.e_f0), n.theta_dk.initial, n.theta_r.initial)


# Projection, [48], with the derivatives that (46) needs


def projection(xp: Any, box: Box, mu: Array, theta: Array) -> tuple[Array, Array, Array]:
    """Projected rate, and its derivatives with respect to ``mu`` and ``theta``."""
    h = (box.upper - box.lower) / 2
    phi = theta - (box.upper + box.lower) / 2
    layer = (1 + box.margin) ** 2 * h**2 - h**2
    depth = xp.maximum(phi**2 - h**2, 0.0) / layer
    root = xp.sqrt((phi * mu) ** 2 + (box.leak * h**2) ** 2)
    push, slope = phi * mu + root, 1 + phi * mu / root
    rate = mu - depth**2 * phi * push / (2 * h**2)
    by_mu = 1 - depth**2 * phi**2 * slope / (2 * h**2)
    by_depth = 4 * depth * phi**2 * push / layer
    by_theta = -(by_depth + depth**2 * (mu * phi * slope + push)) / (2 * h**2)
    return rate, by_mu, by_theta


def clip_estimate(xp: Any, box: Box, theta: Array) -> Array:
    """Bring an estimate back to the interval widened by its layer."""
    epsilon = box.margin * (box.upper - box.lower) / 2
    return xp.minimum(xp.maximum(theta, box.lower - epsilon), box.upper + epsilon)


# Arm


class Pose(NamedTuple):
    """Sines, cosines and Jacobian of a pose."""

    s2: Array
    c2: Array
    x_r1: Array
    x_r2: Array
    J11: Array
    J12: Array
    J21: Array
    J22: Array


def pose(xp: Any, n: Numbers, q1: Array, q2: Array) -> Pose:
    """Forward kinematics, (2)."""
    s1, c1 = xp.sin(q1), xp.cos(q1)
    s12, c12 = xp.sin(q1 + q2), xp.cos(q1 + q2)
    x_r1, x_r2 = n.l1 * c1 + n.l2 * c12, n.l1 * s1 + n.l2 * s12
    return Pose(xp.sin(q2), xp.cos(q2), x_r1, x_r2, -x_r2, -n.l2 * s12, x_r1, n.l2 * c12)


def plant_rates(xp: Any, n: Numbers, x: Any, tau1: Array, tau2: Array) -> tuple[Array, ...]:
    """Rates of (q1, q2, q1_dot, q2_dot, x_m, x_m_dot): (1), (5)-(8) and (6)."""
    q1, q2, q1_dot, q2_dot, x_m, x_m_dot = x
    at = pose(xp, n, q1, q2)
    F_m = n.K_I * xp.maximum(at.x_r1 - x_m, 0.0)
    M11, M12, M22 = n.p1 + 2 * n.p3 * at.c2, n.p2 + n.p3 * at.c2, n.p2
    b1 = tau1 + n.p3 * at.s2 * q2_dot * (2 * q1_dot + q2_dot) - at.J11 * F_m
    b2 = tau2 - n.p3 * at.s2 * q1_dot**2 - at.J12 * F_m
    det = M11 * M22 - M12 * M12
    return (
        q1_dot,
        q2_dot,
        (M22 * b1 - M12 * b2) / det,
        (M11 * b2 - M12 * b1) / det,
        x_m_dot,
        (F_m - n.k_s * (x_m - n.x_0)) / n.m,
    )


# Law


class Desired(NamedTuple):
    """Desired tip position and its derivatives, (25), (45), (46)."""

    x_rd1: Array
    x_rd1_dot: Array
    drift: Array
    """(46) without the term of the mass's acceleration."""
    by_acceleration: Array
    """Factor of the mass's acceleration in (46)."""
    u_f_dot: Array
    theta_dk_dot: Array


def desired(xp: Any, n: Numbers, x_m: Array, x_m_dot: Array, u: Array, theta: Array) -> Desired:
    """Return (16)-(18), (25), (27), (45) and (46)."""
    t = xp.tanh(n.x_md - x_m)
    s = 1 - t**2
    v, Y_d, inside = x_m_dot, x_m - n.x_0, 1 - u**2
    eta = -v + n.alpha1 * t + n.alpha2 * u
    u_dot = inside * (n.alpha2 * t - n.alpha3 * u) - n.k1 * eta
    P, P_mu, P_theta = projection(xp, n.theta_dk, n.Gamma * Y_d * eta, theta)

    # d/du of u / (1 - u^2), once and twice
    D, D_u = (1 + u**2) / inside**2, 2 * u * (3 + u**2) / inside**3
    reach = theta + 1 - n.k2 * s
    x_rd1 = Y_d * theta + x_m + n.k2 * t - n.k1 * n.k2 * u / inside
    x_rd1_dot = reach * v + Y_d * P - n.k1 * n.k2 * D * u_dot

    # rates for a mass that does not accelerate
    eta_dot = -n.alpha1 * s * v + n.alpha2 * u_dot
    u_ddot = (
        -2 * u * u_dot * (n.alpha2 * t - n.alpha3 * u)
        - inside * (n.alpha2 * s * v + n.alpha3 * u_dot)
        - n.k1 * eta_dot
    )
    mu_dot = n.Gamma * (v * eta + Y_d * eta_dot)
    drift = (
        (2 * P - 2 * n.k2 * s * t * v) * v
        + Y_d * (P_mu * mu_dot + P_theta * P)
        - n.k1 * n.k2 * (D_u * u_dot**2 + D * u_ddot)
    )
    by_acceleration = reach - n.Gamma * Y_d**2 * P_mu - n.k1**2 * n.k2 * D
    return Desired(x_rd1, x_rd1_dot, drift, by_acceleration, u_dot, P)


def law_flow(xp: Any, n: Numbers, y: Measured, s: LawState) -> Flow:
    """Return the force-limiting law (32) with the regressor of (31) and the adaptation (33)."""
    at = pose(xp, n, y.q1, y.q2)
    d = desired(xp, n, y.x_m, y.x_m_dot, s.u_f, s.theta_dk)
    x_r1_dot = at.J11 * y.q1_dot + at.J12 * y.q2_dot
    x_r2_dot = at.J21 * y.q1_dot + at.J22 * y.q2_dot
    e1, e2 = d.x_rd1 - at.x_r1, n.x_rd2 - at.x_r2
    e1_dot, e2_dot = d.x_rd1_dot - x_r1_dot, -x_r2_dot
    r1, r2 = e1_dot + n.alpha[0] * e1, e2_dot + n.alpha[1] * e2

    reference = (d.x_rd1_dot + n.alpha[0] * e1, n.alpha[1] * e2)
    reference_dot = (d.drift + n.alpha[0] * e1_dot, n.alpha[1] * e2_dot)
    Y1, Y2 = regressor(xp, n, at, y, reference, reference_dot, d.by_acceleration)
    F1 = xp.sum(Y1 * s.theta_r, axis=0) + xp.tanh(e1) + n.k3[0] * xp.tanh(r1)
    F2 = xp.sum(Y2 * s.theta_r, axis=0) + xp.tanh(e2) + n.k3[1] * xp.tanh(r2)
    theta_r_dot, _, _ = projection(xp, n.theta_r, n.Gamma_r * (Y1 * r1 + Y2 * r2), s.theta_r)
    return Flow(
        at.J11 * F1 + at.J21 * F2,
        at.J12 * F1 + at.J22 * F2,
        LawState(d.u_f_dot, d.theta_dk_dot, theta_r_dot),
    )


def regressor(
    xp: Any, n: Numbers, at: Pose, y: Measured, v: Any, a: Any, by_acceleration: Array
) -> tuple[Array, Array]:
    """Rows of ``Y_r`` of (31); ``v`` and ``a`` are the reference velocity and acceleration."""
    det = n.l1 * n.l2 * at.s2

    def to_joints(f1: Array, f2: Array) -> tuple[Array, Array]:  # J^-1 f
        return (at.J22 * f1 - at.J12 * f2) / det, (at.J11 * f2 - at.J21 * f1) / det

    def to_tip(t1: Array, t2: Array) -> tuple[Array, Array]:  # J^-T t
        return (at.J22 * t1 - at.J21 * t2) / det, (at.J11 * t2 - at.J12 * t1) / det

    def inertia(b1: Array, b2: Array) -> list[tuple[Array, Array]]:  # of p1, p2 and p3
        return [(b1, 0.0 * b1), (b2, b1 + b2), (at.c2 * (2 * b1 + b2), at.c2 * b1)]

    w1, w2 = to_joints(*v)
    turning = y.q1_dot + y.q2_dot
    J11_dot = -at.J21 * y.q1_dot - at.J22 * y.q2_dot
    J12_dot = -at.J22 * turning
    J21_dot = at.J11 * y.q1_dot + at.J12 * y.q2_dot
    J22_dot = at.J12 * turning
    b1, b2 = to_joints(a[0] - J11_dot * w1 - J12_dot * w2, a[1] - J21_dot * w1 - J22_dot * w2)
    moved = inertia(b1, b2)
    coriolis = (-at.s2 * (y.q2_dot * w1 + turning * w2), at.s2 * y.q1_dot * w1)
    moved[2] = (moved[2][0] + coriolis[0], moved[2][1] + coriolis[1])

    penetration = xp.maximum(at.x_r1 - y.x_m, 0.0)
    unit = inertia(*to_joints(by_acceleration, 0.0 * by_acceleration))
    columns = []
    for pushed, carried in zip(unit, moved, strict=True):
        f1, f2 = to_tip(*pushed)
        columns += [(f1 * penetration, f2 * penetration)]
        columns += [(-f1 * (y.x_m - n.x_0), -f2 * (y.x_m - n.x_0)), to_tip(*carried)]
    columns += [(penetration, 0.0 * penetration)]
    first, second = zip(*columns, strict=True)
    return xp.stack(first), xp.stack(second)


# The loop, sampled and continuous


def clip_torque(xp: Any, n: Numbers, tau1: Array, tau2: Array) -> tuple[Array, Array]:
    """Torque that reaches the joints."""
    limit1, limit2 = n.tau_max
    return (
        xp.minimum(xp.maximum(tau1, -limit1), limit1),
        xp.minimum(xp.maximum(tau2, -limit2), limit2),
    )


def law_step(xp: Any, n: Numbers, s: LawState, rates: LawState, dt: float) -> LawState:
    """Euler step of the law's state, its estimates clipped."""
    return LawState(
        s.u_f + dt * rates.u_f,
        clip_estimate(xp, n.theta_dk, s.theta_dk + dt * rates.theta_dk),
        clip_estimate(xp, n.theta_r, s.theta_r + dt * rates.theta_r),
    )


def rk4(rates: Callable[[Array], Array], x: Array, dt: float) -> Array:
    """One step of the classical Runge-Kutta method."""
    a = rates(x)
    b = rates(x + dt / 2 * a)
    c = rates(x + dt / 2 * b)
    d = rates(x + dt * c)
    return x + dt / 6 * (a + 2 * b + 2 * c + d)


def closed_loop_rates(xp: Any, n: Numbers, x: Array) -> tuple[tuple[Array, ...], LawState]:
    """Rates of plant and law in continuous time.

    ``x`` holds the six plant states, ``u_f``, ``theta_dk`` and the entries of ``theta_r``.
    """
    flow = law_flow(xp, n, Measured(*x[:6]), LawState(x[6], x[7], x[8:]))
    tau1, tau2 = clip_torque(xp, n, flow.tau1, flow.tau2)
    return plant_rates(xp, n, x[:6], tau1, tau2), flow.rates
