"""A `Stepper` is its function, in place, on either backend."""

from __future__ import annotations

import gc
import warnings

import casadi as ca
import numpy as np
import pytest
from hypothesis import given

from alight.errors import UnknownName
from alight.kernels import toolchain
from alight.kernels.compilers import CompilerUnavailable
from alight.kernels.stepper import Stepper
from alight.symbolic.build import build
from alight.symbolic.ops import sin, tanh
from tests.compiler import NEEDS_COMPILER, has_compiler
from tests.strategies import between, vectors

BACKENDS = pytest.mark.parametrize("backend", ["vm", pytest.param("c", marks=NEEDS_COMPILER)])
U, X, P = ca.SX.sym("u", 2), ca.SX.sym("x", 3), ca.SX.sym("p")
FUNCTION = build(
    "rotate",
    {"u": U, "x": X, "p": P},
    {"x_next": ca.vertcat(X[1], X[2] + P * tanh(U[0]), X[0]), "y": ca.vertcat(X[0] * U[1], sin(X))},
)
MADE = {"vm": Stepper(FUNCTION, "vm"), **({"c": Stepper(FUNCTION, "c")} if has_compiler() else {})}


@BACKENDS
@given(vectors(2, 10.0), vectors(3, 10.0), between(-3.0, 3.0))
def test_steps_are_those_of_the_function_bit_by_bit(backend, u, x, p):
    """Three in a row; the state that is written is read by the next one, and by nothing before."""
    stepper = MADE[backend]
    stepper.u[:], stepper.x[:], stepper.p[:] = u, x, p
    for _ in range(3):
        x, y = (np.array(v).ravel() for v in FUNCTION(u, x, p))
        stepper.step()
        np.testing.assert_array_equal(stepper.x, x)
        np.testing.assert_array_equal(stepper.y, y)
    np.testing.assert_array_equal(stepper.u, u)
    np.testing.assert_array_equal(stepper.p, [p])


@BACKENDS
def test_two_steppers_of_one_function_do_not_meet(backend):
    one, other = Stepper(FUNCTION, backend), Stepper(FUNCTION, backend)
    for each, first in ((one, 1.0), (other, 2.0)):
        each.x[:], each.u[:] = (first, 0.0, 0.0), 1.0
    for _ in range(3):
        one.step()
        other.step()
    assert one.x[0] == 1.0 and other.x[0] == 2.0


@BACKENDS
def test_the_step_alone_keeps_alive_what_it_works_on(backend):
    stepper = Stepper(FUNCTION, backend)
    x, step = stepper.x, stepper.step
    x[:] = (1.0, 2.0, 3.0)
    del stepper
    gc.collect()
    rubbish = [np.ones(9) for _ in range(1000)]
    step()
    np.testing.assert_array_equal(x, [2.0, 3.0, 1.0])
    assert rubbish[0][0] == 1.0


@NEEDS_COMPILER
def test_steps_that_do_not_return_to_python_are_the_same_steps():
    one, many = Stepper(FUNCTION, "c"), Stepper(FUNCTION, "c")
    for each in (one, many):
        each.x[:], each.u[:], each.p[:] = (0.1, 0.2, 0.3), (0.4, 0.5), 0.6
    for _ in range(1000):
        one.step()
    assert many.seconds_in_c(1000) > 0
    np.testing.assert_array_equal(one.block, many.block)


def test_an_unknown_backend_is_refused():
    with pytest.raises(UnknownName, match="one of: auto, c, vm"):
        Stepper(FUNCTION, "gpu")  # type: ignore[arg-type]


def test_without_a_compiler_it_steps_in_the_virtual_machine_with_one_warning(monkeypatch, tmp_path):
    monkeypatch.setenv("CC", str(tmp_path / "nowhere"))
    monkeypatch.setattr(toolchain, "_told", set())
    with pytest.warns(UserWarning, match="steps in CasADi's virtual machine, .*nowhere") as told:
        made = [Stepper(FUNCTION) for _ in range(2)]
    assert [each.backend for each in made] == ["vm", "vm"] and len(told) == 1
    with pytest.raises(CompilerUnavailable, match="nowhere"):
        Stepper(FUNCTION, "c")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert Stepper(FUNCTION, "vm").backend == "vm"
