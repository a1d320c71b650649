"""The whole sampled loop by hand in scalar Python, compiled by Numba; imported by its peer only.

Equation numbers are the paper's; ``n`` is a named tuple of floats.
"""

from __future__ import annotations

from math import cos, sin, sqrt, tanh

import numpy as np
from numba import njit


@njit
def projection(mu, theta, lower, upper, margin, leak):
    """Projected rate [48], and its derivatives with respect to ``mu`` and ``theta``."""
    h = 0.5 * (upper - lower)
    phi = theta - 0.5 * (upper + lower)
    excess = phi * phi - h * h
    if excess <= 0.0:
        return mu, 1.0, 0.0
    layer = margin * (2.0 + margin) * h * h
    depth = excess / layer
    outward, delta = phi * mu, leak * h * h
    root = sqrt(outward * outward + delta * delta)
    push, slope = outward + root, 1.0 + outward / root
    scale = 1.0 / (2.0 * h * h)
    by_theta = 4.0 * depth * phi * phi * push / layer + depth * depth * (mu * phi * slope + push)
    return (
        mu - depth * depth * phi * push * scale,
        1.0 - depth * depth * phi * phi * slope * scale,
        -by_theta * scale,
    )


@njit
def clip(value, low, high):
    """Value brought between two bounds."""
    return min(max(value, low), high)


@njit
def plant_rates(n, q1, q2, w1, w2, x_m, v_m, tau1, tau2):
    """Accelerations of joints and mass: (1), (5)-(8) and (6)."""
    s1, c1, s12, c12 = sin(q1), cos(q1), sin(q1 + q2), cos(q1 + q2)
    s2, c2 = sin(q2), cos(q2)
    gap = n.l1 * c1 + n.l2 * c12 - x_m
    F_m = n.K_I * gap if gap > 0.0 else 0.0
    M11, M12, M22 = n.p1 + 2.0 * n.p3 * c2, n.p2 + n.p3 * c2, n.p2
    b1 = tau1 + n.p3 * s2 * w2 * (2.0 * w1 + w2) + (n.l1 * s1 + n.l2 * s12) * F_m
    b2 = tau2 - n.p3 * s2 * w1 * w1 + n.l2 * s12 * F_m
    scale = 1.0 / (M11 * M22 - M12 * M12)
    return (
        (M22 * b1 - M12 * b2) * scale,
        (M11 * b2 - M12 * b1) * scale,
        (F_m - n.k_s * (x_m - n.x_0)) / n.m,
    )


@njit
def plant_step(n, x, tau1, tau2, dt):
    """One classical Runge-Kutta step of the plant, in place."""
    q1, q2, w1, w2, x_m, v_m = x[0], x[1], x[2], x[3], x[4], x[5]
    half = 0.5 * dt
    a1, a2, a3 = plant_rates(n, q1, q2, w1, w2, x_m, v_m, tau1, tau2)
    w1b, w2b, v_b = w1 + half * a1, w2 + half * a2, v_m + half * a3
    b1, b2, b3 = plant_rates(
        n, q1 + half * w1, q2 + half * w2, w1b, w2b, x_m + half * v_m, v_b, tau1, tau2
    )
    w1c, w2c, v_c = w1 + half * b1, w2 + half * b2, v_m + half * b3
    c1, c2, c3 = plant_rates(
        n, q1 + half * w1b, q2 + half * w2b, w1c, w2c, x_m + half * v_b, v_c, tau1, tau2
    )
    w1d, w2d, v_d = w1 + dt * c1, w2 + dt * c2, v_m + dt * c3
    d1, d2, d3 = plant_rates(
        n, q1 + dt * w1c, q2 + dt * w2c, w1d, w2d, x_m + dt * v_c, v_d, tau1, tau2
    )
    sixth = dt / 6.0
    x[0] = q1 + sixth * (w1 + 2.0 * w1b + 2.0 * w1c + w1d)
    x[1] = q2 + sixth * (w2 + 2.0 * w2b + 2.0 * w2c + w2d)
    x[2] = w1 + sixth * (a1 + 2.0 * b1 + 2.0 * c1 + d1)
    x[3] = w2 + sixth * (a2 + 2.0 * b2 + 2.0 * c2 + d2)
    x[4] = x_m + sixth * (v_m + 2.0 * v_b + 2.0 * v_c + v_d)
    x[5] = v_m + sixth * (a3 + 2.0 * b3 + 2.0 * c3 + d3)


@njit
def desired(n, x_m, v, u, theta):
    """Desired tip position (25), (45), (46), and the rates (18) and (27).

    (46) is given without the mass's acceleration, and with that as a factor of its own.
    """
    t = tanh(n.x_md - x_m)
    s, Y_d, inside = 1.0 - t * t, x_m - n.x_0, 1.0 - u * u
    eta = -v + n.alpha1 * t + n.alpha2 * u
    filtered = n.alpha2 * t - n.alpha3 * u
    u_dot = inside * filtered - n.k1 * eta
    P, P_mu, P_theta = projection(
        n.Gamma * Y_d * eta, theta, n.dk_lower, n.dk_upper, n.margin, n.leak
    )
    k1k2 = n.k1 * n.k2
    D, D_u = (1.0 + u * u) / inside**2, 2.0 * u * (3.0 + u * u) / inside**3
    reach = theta + 1.0 - n.k2 * s
    x_rd = Y_d * theta + x_m + n.k2 * t - k1k2 * u / inside
    x_rd_dot = reach * v + Y_d * P - k1k2 * D * u_dot
    eta_dot = -n.alpha1 * s * v + n.alpha2 * u_dot
    u_ddot = -2.0 * u * u_dot * filtered
    u_ddot -= inside * (n.alpha2 * s * v + n.alpha3 * u_dot) + n.k1 * eta_dot
    mu_dot = n.Gamma * (v * eta + Y_d * eta_dot)
    drift = 2.0 * (P - n.k2 * s * t * v) * v + Y_d * (P_mu * mu_dot + P_theta * P)
    drift -= k1k2 * (D_u * u_dot * u_dot + D * u_ddot)
    by_acceleration = reach - n.Gamma * Y_d * Y_d * P_mu - n.k1 * k1k2 * D
    return x_rd, x_rd_dot, drift, by_acceleration, u_dot, P


@njit
def law(n, x, w1, w2, v_m, memory, theta, Gamma_r, lower, upper, Y, dt):
    """Torque of (32); filter and estimates move one Euler step of (18), (27) and (33)."""
    q1, q2, x_m = x[0], x[1], x[4]
    s2, c2 = sin(q2), cos(q2)
    s12, c12 = sin(q1 + q2), cos(q1 + q2)
    x1, x2 = n.l1 * cos(q1) + n.l2 * c12, n.l1 * sin(q1) + n.l2 * s12
    J12, J22 = -n.l2 * s12, n.l2 * c12  # J11 = -x2, J21 = x1
    x1_dot, x2_dot = -x2 * w1 + J12 * w2, x1 * w1 + J22 * w2

    x_rd, x_rd_dot, drift, by_acceleration, u_dot, P = desired(n, x_m, v_m, memory[0], memory[1])
    e1, e2 = x_rd - x1, n.x_rd2 - x2
    e1_dot, e2_dot = x_rd_dot - x1_dot, -x2_dot
    r1, r2 = e1_dot + n.alpha_1 * e1, e2_dot + n.alpha_2 * e2

    scale = 1.0 / (n.l1 * n.l2 * s2)
    v1, v2 = x_rd_dot + n.alpha_1 * e1, n.alpha_2 * e2
    j1, j2 = (J22 * v1 - J12 * v2) * scale, (-x2 * v2 - x1 * v1) * scale
    a1 = drift + n.alpha_1 * e1_dot + x2_dot * j1 + J22 * (w1 + w2) * j2
    a2 = n.alpha_2 * e2_dot - x1_dot * j1 - J12 * (w1 + w2) * j2
    b1, b2 = (J22 * a1 - J12 * a2) * scale, (-x2 * a2 - x1 * a1) * scale
    g1, g2 = J22 * by_acceleration * scale, -x1 * by_acceleration * scale

    gap = max(x1 - x_m, 0.0)
    compression = x_m - n.x_0
    pushed = ((g1, 0.0), (g2, g1 + g2), (c2 * (2.0 * g1 + g2), c2 * g1))
    carried = (
        (b1, 0.0),
        (b2, b1 + b2),
        (
            c2 * (2.0 * b1 + b2) - s2 * (w2 * j1 + (w1 + w2) * j2),
            c2 * b1 + s2 * w1 * j1,
        ),
    )
    for j in range(3):
        t1, t2 = pushed[j]
        f1, f2 = (J22 * t1 - x1 * t2) * scale, (-x2 * t2 - J12 * t1) * scale
        Y[0, 3 * j], Y[1, 3 * j] = f1 * gap, f2 * gap
        Y[0, 3 * j + 1], Y[1, 3 * j + 1] = -f1 * compression, -f2 * compression
        t1, t2 = carried[j]
        Y[0, 3 * j + 2] = (J22 * t1 - x1 * t2) * scale
        Y[1, 3 * j + 2] = (-x2 * t2 - J12 * t1) * scale
    Y[0, 9], Y[1, 9] = gap, 0.0

    F1, F2 = tanh(e1) + n.k3_1 * tanh(r1), tanh(e2) + n.k3_2 * tanh(r2)
    for i in range(10):
        F1 += Y[0, i] * theta[i]
        F2 += Y[1, i] * theta[i]
        mu = Gamma_r[i] * (Y[0, i] * r1 + Y[1, i] * r2)
        rate, _, _ = projection(mu, theta[i], lower[i], upper[i], n.margin, n.leak)
        epsilon = 0.5 * n.margin * (upper[i] - lower[i])
        theta[i] = clip(theta[i] + dt * rate, lower[i] - epsilon, upper[i] + epsilon)
    epsilon = 0.5 * n.margin * (n.dk_upper - n.dk_lower)
    memory[0] += dt * u_dot
    memory[1] = clip(memory[1] + dt * P, n.dk_lower - epsilon, n.dk_upper + epsilon)
    return -x2 * F1 + x1 * F2, J12 * F1 + J22 * F2


@njit
def closed_loop(n, x, memory, theta, Gamma_r, lower, upper, ticks, every, rate, substeps):
    """Run the sampled loop and return the rows that are kept."""
    rows = np.empty(((ticks + every - 1) // every, 3))
    Y = np.empty((2, 10))
    dt = 1.0 / rate
    q1, q2, x_m = x[0], x[1], x[4]
    for k in range(ticks):
        if k % every == 0:
            rows[k // every] = x[0], x[1], x[4]
        w1, w2, v_m = (x[0] - q1) * rate, (x[1] - q2) * rate, (x[4] - x_m) * rate
        q1, q2, x_m = x[0], x[1], x[4]
        tau1, tau2 = law(n, x, w1, w2, v_m, memory, theta, Gamma_r, lower, upper, Y, dt)
        tau1 = clip(tau1, -n.limit_1, n.limit_1)
        tau2 = clip(tau2, -n.limit_2, n.limit_2)
        for _ in range(substeps):
            plant_step(n, x, tau1, tau2, dt / substeps)
    return rows
