"""Drake: plant and law as systems in Python on its Simulator, and the whole tick as one system.

Classes of Drake can be stated only once Drake is imported, hence the functions around them.
"""

from __future__ import annotations

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

SEEN = [0, 1, 4]
"""Places of ``[q1, q2, x_m]`` in the state of the plant."""
INTEGRATOR = "bogacki_shampine3"
"""The fastest that stays within 1e-4 here, of Drake's explicit ones of order 3 and 5.

It controls its error at Drake's default accuracy of 1e-4. ``runge_kutta3``, Drake's default, takes
1.4 times as many steps; four fixed steps of it in a sample take 1.4 to 1.6 times as long.
"""


def simulation(problem: Problem, diagram: Any, log: Any) -> Run:
    """Run a diagram from its default state; ``log`` is a sink whose first rows are kept."""
    from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig

    simulator = Simulator(diagram)
    ApplySimulatorConfig(SimulatorConfig(integration_scheme=INTEGRATOR), simulator)

    def run() -> np.ndarray:
        simulator.reset_context(diagram.CreateDefaultContext())
        simulator.Initialize()
        simulator.AdvanceTo(problem.duration)
        return log.FindLog(simulator.get_context()).data()[SEEN, : len(problem.times)].T

    return run


# Plant in continuous time, law sampled


def plant_system(problem: Problem) -> Any:
    """Plant with the torque as input and its state as output."""
    from pydrake.systems.framework import BasicVector, LeafSystem

    n = problem.numbers

    class Plant(LeafSystem):
        def __init__(self) -> None:
            super().__init__()
            self.DeclareVectorInputPort("tau", 2)
            start = BasicVector([*n.q0, 0.0, 0.0, n.x_m0, 0.0])
            self.DeclareStateOutputPort("x", self.DeclareContinuousState(start))

        def DoCalcTimeDerivatives(self, context: Any, derivatives: Any) -> None:
            x = context.get_continuous_state_vector().CopyToVector()
            tau = self.get_input_port().Eval(context)
            derivatives.SetFromVector(np.array(plant_rates(np, n, x, *tau)))

    return Plant()


def law_system(problem: Problem) -> Any:
    """Law with the state of the plant as input and the held torque as output.

    Its state: filter, estimates, last readings, torque.
    """
    from pydrake.systems.framework import LeafSystem

    n, dt = with_arrays(problem.numbers, np), 1 / problem.sample_rate
    start = np.hstack([*initial_law_state(n, np), *n.q0, n.x_m0])

    class Law(LeafSystem):
        def __init__(self) -> None:
            super().__init__()
            self.DeclareVectorInputPort("x", 6)
            self.DeclareDiscreteState(start)
            held = self.DeclareDiscreteState(2)
            self.DeclareStateOutputPort("tau", held)
            self.DeclarePeriodicDiscreteUpdateEvent(dt, 0.0, self.sample)

        def sample(self, context: Any, following: Any) -> None:
            seen = self.get_input_port().Eval(context)[SEEN]
            memory = context.get_discrete_state(0).value()
            law, before = LawState(memory[0], memory[1], memory[2:-3]), memory[-3:]
            q1_dot, q2_dot, x_m_dot = (seen - before) / dt
            measured = Measured(seen[0], seen[1], q1_dot, q2_dot, seen[2], x_m_dot)
            flow = law_flow(np, n, measured, law)
            law = law_step(np, n, law, flow.rates, dt)
            following.set_value(0, np.hstack([*law, seen]))
            following.set_value(1, clip_torque(np, n, flow.tau1, flow.tau2))

    return Law()


def _prepare_systems(problem: Problem) -> Run:
    from pydrake.systems.framework import DiagramBuilder
    from pydrake.systems.primitives import LogVectorOutput

    builder = DiagramBuilder()
    plant, law = (builder.AddSystem(system(problem)) for system in (plant_system, law_system))
    builder.Connect(plant.get_output_port(), law.get_input_port())
    builder.Connect(law.get_output_port(), plant.get_input_port())
    log = LogVectorOutput(plant.get_output_port(), builder, RECORD_EVERY / problem.sample_rate)
    return simulation(problem, builder.Build(), log)


# One discrete system


def loop_system(problem: Problem) -> Any:
    """Whole sample as one discrete update that calls generated C."""
    from pydrake.systems.framework import LeafSystem

    from alight_benchmarks.generated import compiled, start_of, tick_of

    scenario = problem.scenario
    function, numbers = tick_of(scenario)
    tick, start = compiled(function), start_of(scenario)
    size = len(start)

    class Loop(LeafSystem):
        def __init__(self) -> None:
            super().__init__()
            state = self.DeclareDiscreteState(np.hstack([start, start[SEEN]]))
            self.DeclareStateOutputPort("x", state)
            self.DeclarePeriodicDiscreteUpdateEvent(1 / problem.sample_rate, 0.0, self.sample)

        def sample(self, context: Any, following: Any) -> None:
            state = context.get_discrete_state(0).value()
            following.set_value(0, np.hstack(tick(state[:size], state[size:], numbers)))

    return Loop()


def _prepare_loop(problem: Problem) -> Run:
    from pydrake.systems.framework import DiagramBuilder
    from pydrake.systems.primitives import LogVectorOutput

    builder = DiagramBuilder()
    loop = builder.AddSystem(loop_system(problem))
    log = LogVectorOutput(loop.get_output_port(), builder, RECORD_EVERY / problem.sample_rate)
    return simulation(problem, builder.Build(), log)


PEERS = (
    Peer(
        name="Drake, LeafSystems in NumPy",
        package="drake",
        how=f"plant as continuous, law as sampled LeafSystem in NumPy; {INTEGRATOR}, its own steps",
        prepare=_prepare_systems,
        tolerance=1e-4,
    ),
    Peer(
        name="Drake, one system in C",
        package="drake",
        how="one discrete LeafSystem in Python whose update calls the whole sample in C",
        prepare=_prepare_loop,
    ),
)
