"""The program of a loop full of switches: one run on every backend, with and without its zeros."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from alight.kernels.select import runner
from alight.models import HuntCrossley, KelvinVoigt, LinearSpring, TipFriction
from alight.simulation.closed_loop import ClosedLoop, InitialState, tick_program
from alight.symbolic.parameters import numeric_fields, rebind
from alight.testbed import Encoder, Testbed, Transducer
from tests.compiler import NEEDS_COMPILER
from tests.control.cases import PLANT, told
from tests.testbed.laws import Steady

CONTACTS = pytest.mark.parametrize(
    "contact",
    [
        LinearSpring(K_I=2e4),
        KelvinVoigt(K_I=2e4, damping=3.0),
        HuntCrossley(K_I=2e4, dissipation=0.02),
    ],
    ids=lambda contact: type(contact).__name__,
)
TICKS = 1500


def bouncing(contact: LinearSpring | KelvinVoigt | HuntCrossley, **settings: float) -> ClosedLoop:
    """A steady torque that presses the tip on the mass: it bounces again and again."""
    plant = dataclasses.replace(PLANT, contact=contact, tip_friction=TipFriction(**settings))
    q = PLANT.arm.inverse((PLANT.body.x_0, 0.4), "-")
    tau = PLANT.arm.J(q).T @ [20.0, 0.0]
    law = Steady((float(tau[0]), float(tau[1])))
    return ClosedLoop(plant, Testbed(transducer=Transducer(noise=1e-6)), law, substeps=1)


def begun() -> InitialState:
    q = PLANT.arm.inverse((PLANT.body.x_0 - 1e-3, 0.4), "-")
    return InitialState((float(q[0]), float(q[1])), PLANT.body.x_0, (-0.6, 0.4))


def noise() -> np.ndarray:
    return np.random.default_rng(0).standard_normal(TICKS)


@NEEDS_COMPILER
@CONTACTS
@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_virtual_machine_and_compiled_c_have_the_same_bits_through_many_switches(contact, friction):
    loop = bouncing(contact, mu=friction)
    program = tick_program(loop, None, loop.zeros())
    x, p = loop.initial_column(begun()), loop.parameter_values(loop.zeros())
    (x_vm, y_vm), (x_c, y_c) = (
        runner(program, backend).run(x, noise(), p) for backend in ("vm", "c")
    )
    gap = y_vm[:, program.recorded.slices()["gap"]]
    assert len(y_vm) == TICKS and np.abs(np.diff(gap[:, 0] >= 0)).sum() >= 8
    assert y_vm.tobytes() == y_c.tobytes() and x_vm.tobytes() == x_c.tobytes()


# Zeros


def zeroed(contact: LinearSpring | KelvinVoigt | HuntCrossley, pattern: int) -> ClosedLoop:
    """A loop under the paper's law with all it can have; each bit of the pattern is a zero."""
    off = [not pattern >> i & 1 for i in range(8)]
    damping = {"damping": 3.0, "dissipation": 0.02}
    sides = {name: value for name, value in damping.items() if hasattr(contact, name)}
    plant = dataclasses.replace(
        PLANT,
        arm=rebind(PLANT.arm, viscous=(1.0 * off[0], 0.3 * off[0]), coulomb=(0.0, 0.1 * off[1])),
        body=rebind(PLANT.body, damping=2.0 * off[2]),
        contact=rebind(contact, **{name: value * off[3] for name, value in sides.items()}),
        tip_friction=TipFriction(mu=0.3 * off[4], damping=1e-3 * off[5]),
    )
    testbed = Testbed(
        encoder=Encoder(counts=614400.0 * off[6]),
        transducer=Transducer(resolution=1e-6 * off[6], noise=1e-6 * off[7]),
    )
    return ClosedLoop(plant, testbed, told(plant), substeps=1)


@CONTACTS
@pytest.mark.parametrize("pattern", [0b11111111, 0b10110101, 0b01001010])
def test_leaving_zeros_out_of_a_program_changes_no_bit_of_its_run(contact, pattern):
    """But the sign of a zero."""
    loop = zeroed(contact, pattern)
    runs = []
    for absent in (frozenset(), loop.zeros()):
        program = tick_program(loop, None, absent)
        x, p = loop.initial_column(begun()), loop.parameter_values(absent)
        assert len(p) == len(program.parameters)
        runs.append(runner(program, "vm").run(x, noise()[:400], p))
        runs[-1] += (program.recorded.slices(), program.usual.n_instructions())
    (x, y, rows, whole), (x_less, y_less, _, less) = runs
    assert less < whole
    assert np.abs(np.diff(y[:, rows["Lambda"]][:, 0])).sum() >= 2  # it touches and lets go
    np.testing.assert_array_equal(y_less, y)
    np.testing.assert_array_equal(x_less, x)


@CONTACTS
def test_what_is_left_out_are_the_parameters_that_are_zero(contact):
    loop = zeroed(contact, 0b11110000)
    zeros = loop.zeros()
    assert {"plant.tip_friction.mu", "testbed.encoder.counts"} <= zeros
    fields = [
        (path, np.atleast_1d(value))
        for name, part in loop.parameters().items()
        for path, value, _ in numeric_fields(part, f"{name}.")
    ]
    kept = np.concatenate([value for path, value in fields if path not in zeros])
    np.testing.assert_array_equal(loop.parameter_values(zeros), kept)
    assert len(tick_program(loop, ("x_m",), zeros).parameters) == len(kept)
    assert not any(value.any() for path, value in fields if path in zeros)
    assert all(value.any() for path, value in fields if path not in zeros)
