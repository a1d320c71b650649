"""JAX in double precision: one run as a scan, and a batch of runs by vmap.

Of the forms that were tried the fastest is written here: the plant's state as one array in a single
run, and as separate scalars under vmap; substeps in a loop of their own, not unrolled.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from alight_benchmarks.equations import (
    LawState,
    Measured,
    clip_torque,
    initial_law_state,
    law_flow,
    law_step,
    plant_rates,
    rk4,
    with_arrays,
)
from alight_benchmarks.peer import RECORD_EVERY, Numbers, Peer, Problem, Run, varied

BATCH = 1024
"""Runs in a batch; any number from 256 to 4096 does as well within a few per cent."""

Step = Callable[[Numbers, Any, Any, float], Any]


def stacked_step(n: Numbers, x: Any, tau: Any, dt: float) -> Any:
    """Runge-Kutta step of the plant's state as one array."""
    import jax.numpy as jnp

    return rk4(lambda x: jnp.stack(plant_rates(jnp, n, x, *tau)), x, dt)


def separate_step(n: Numbers, x: Any, tau: Any, dt: float) -> Any:
    """Runge-Kutta step of the plant's state as a tuple of scalars."""
    import jax.numpy as jnp

    def rates(x: Any) -> Any:
        return plant_rates(jnp, n, x, *tau)

    def ahead(slopes: Any, by: float) -> Any:
        return tuple(value + by * slope for value, slope in zip(x, slopes, strict=True))

    a = rates(x)
    b = rates(ahead(a, dt / 2))
    c = rates(ahead(b, dt / 2))
    d = rates(ahead(c, dt))
    return ahead([p + 2 * q + 2 * r + s for p, q, r, s in zip(a, b, c, d, strict=True)], dt / 6)


def sampled_loop(problem: Problem, n: Numbers, step: Step) -> Any:
    """Rows of one run, as an expression that JAX traces."""
    import jax
    import jax.numpy as jnp

    n, dt = with_arrays(n, jnp), 1 / problem.sample_rate

    def tick(carry: Any, _: None) -> Any:
        x, before, law = carry
        seen = x[0], x[1], x[4]
        q1_dot, q2_dot, x_m_dot = ((now - old) / dt for now, old in zip(seen, before, strict=True))
        flow = law_flow(jnp, n, Measured(x[0], x[1], q1_dot, q2_dot, x[4], x_m_dot), law)
        tau = clip_torque(jnp, n, flow.tau1, flow.tau2)
        law = law_step(jnp, n, law, flow.rates, dt)
        x = jax.lax.fori_loop(
            0, problem.substeps, lambda _, x: step(n, x, tau, dt / problem.substeps), x
        )
        return (x, seen, law), None

    def block(carry: Any, _: None) -> Any:
        x = carry[0]
        row = jnp.stack([x[0], x[1], x[4]])
        return jax.lax.scan(tick, carry, length=RECORD_EVERY)[0], row

    x = tuple(jnp.asarray(value) for value in (*n.q0, 0.0, 0.0, n.x_m0, 0.0))
    law = LawState(*(jnp.asarray(part) for part in initial_law_state(n, jnp)))
    start = (jnp.stack(x) if step is stacked_step else x, (x[0], x[1], x[4]), law)
    return jax.lax.scan(block, start, length=len(problem.times))[1]


def _prepare(problem: Problem, *, step: Step, batch: int) -> Run:
    import jax

    jax.config.update("jax_enable_x64", True)

    def one(m: Any, k_s: Any) -> Any:
        return sampled_loop(problem, replace(problem.numbers, m=m, k_s=k_s), step)

    many = varied(problem.numbers, batch)
    plants = (many.m, many.k_s) if batch > 1 else (problem.numbers.m, problem.numbers.k_s)
    compiled = jax.jit(jax.vmap(one) if batch > 1 else one).lower(*plants).compile()

    def run() -> np.ndarray:
        return np.asarray(compiled(*plants)).reshape(batch, -1, 3)[0]

    return run


PEERS = (
    Peer(
        name="JAX scan",
        package="jax",
        how="sampled law and Runge-Kutta plant as one jitted lax.scan, float64",
        prepare=partial(_prepare, step=stacked_step, batch=1),
    ),
    Peer(
        name="JAX vmap, batch",
        package="jax",
        how="the same scan under vmap over runs, float64",
        prepare=partial(_prepare, step=separate_step, batch=BATCH),
        batch=BATCH,
    ),
)
