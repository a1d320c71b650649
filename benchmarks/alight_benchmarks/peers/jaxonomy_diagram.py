"""jaxonomy: plant and sampled law as blocks of a diagram, simulated by one JAX-compiled program.

Classes of jaxonomy can be stated only once it is imported, hence the functions around them.
"""

from __future__ import annotations

import logging
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
    with_arrays,
)
from alight_benchmarks.peer import RECORD_EVERY, Peer, Problem, Run


def plant_block(problem: Problem) -> Any:
    """Plant in continuous time, with the torque as input and its state as output."""
    import jax.numpy as jnp
    from jaxonomy import LeafSystem

    n = problem.numbers

    class Plant(LeafSystem):
        def __init__(self) -> None:
            super().__init__(name="plant")
            self.declare_input_port(name="tau")
            start = jnp.array([*n.q0, 0.0, 0.0, n.x_m0, 0.0])
            self.declare_continuous_state(
                default_value=start, ode=self.rates, substeps=problem.substeps
            )
            self.declare_continuous_state_output(name="x")

        def rates(self, time: Any, state: Any, tau: Any) -> Any:
            return jnp.stack(plant_rates(jnp, n, state.continuous_state, tau[0], tau[1]))

    return Plant()


def law_block(problem: Problem) -> Any:
    """Law at its rate, with the state of the plant as input and the held torque as output.

    Its state: filter, estimates, last readings, torque.
    """
    import jax.numpy as jnp
    from jaxonomy import LeafSystem
    from jaxonomy.framework import DependencyTicket

    n, dt = with_arrays(problem.numbers, jnp), 1 / problem.sample_rate
    start = jnp.hstack([*initial_law_state(n, jnp), *map(jnp.asarray, (*n.q0, n.x_m0, 0.0, 0.0))])

    class Law(LeafSystem):
        def __init__(self) -> None:
            super().__init__(name="law")
            self.declare_input_port(name="x")
            self.declare_discrete_state(default_value=start)
            self.declare_periodic_update(self.sample, period=dt, offset=0.0)
            self.declare_output_port(
                self.torque,
                name="tau",
                requires_inputs=False,
                prerequisites_of_calc=[DependencyTicket.xd],
            )

        def torque(self, time: Any, state: Any) -> Any:
            return state.discrete_state[-2:]

        def sample(self, time: Any, state: Any, x: Any) -> Any:
            memory, seen = state.discrete_state, jnp.stack([x[0], x[1], x[4]])
            law, before = LawState(memory[0], memory[1], memory[2:-5]), memory[-5:-2]
            q1_dot, q2_dot, x_m_dot = (seen - before) / dt
            measured = Measured(seen[0], seen[1], q1_dot, q2_dot, seen[2], x_m_dot)
            flow = law_flow(jnp, n, measured, law)
            law = law_step(jnp, n, law, flow.rates, dt)
            return jnp.hstack([*law, seen, *clip_torque(jnp, n, flow.tau1, flow.tau2)])

    return Law()


def _prepare(problem: Problem) -> Run:
    import jax
    import jaxonomy
    from jaxonomy.logging import set_log_level

    jax.config.update("jax_enable_x64", True)
    set_log_level(logging.WARNING)
    builder = jaxonomy.DiagramBuilder()
    plant, law = builder.add(plant_block(problem)), builder.add(law_block(problem))
    builder.connect(plant.output_ports[0], law.input_ports[0])
    builder.connect(law.output_ports[0], plant.input_ports[0])
    diagram = builder.build()
    context = diagram.create_context()
    options = jaxonomy.SimulatorOptions(
        math_backend="jax",
        ode_solver_method="rk4",
        max_minor_step_size=2 / problem.sample_rate,  # the law's samples bound it
        buffer_length=problem.ticks + 100,
        return_context=False,
    )

    def run() -> np.ndarray:
        results = jaxonomy.simulate(
            diagram,
            context,
            (0.0, problem.duration),
            options=options,
            recorded_signals={"x": plant.output_ports[0]},
        )
        return np.asarray(results.outputs["x"])[: problem.ticks : RECORD_EVERY, [0, 1, 4]]

    run()  # traces and compiles
    return run


PEERS = (
    Peer(
        name="jaxonomy",
        package="jaxonomy",
        how="plant (rk4, 4 substeps a sample) and sampled law as blocks, compiled by JAX",
        prepare=_prepare,
    ),
)
