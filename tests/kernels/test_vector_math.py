"""What ``vector.h`` and ``vector_math.h`` promise, in every width, against NumPy and mpmath."""

from __future__ import annotations

import ctypes
import math
import platform
import re
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from importlib import resources, util

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from mpmath import mp

from alight.kernels.lanes import minimax
from alight.kernels.toolchain import load
from tests.compiler import NEEDS_COMPILER

pytestmark = NEEDS_COMPILER

FILES = resources.files("alight.kernels.lanes")
HEADERS = {name: FILES.joinpath(name).read_text("utf-8") for name in ("vector.h", "vector_math.h")}
WIDTHS = (1, 2, 4, 8)
NATIVE = ("-O2", "-march=native")
PLAIN = ("-O2", "-march=x86-64")
"""An old processor, without fused multiply-add."""
EPSILON = 2.0**-52

STATED = {
    name: float(ulps)
    for names, ulps in re.findall(r"^ +([a-z, ]+?) +([\d.]+) ulp ", HEADERS["vector_math.h"], re.M)
    for name in names.split(", ")
}
"""Greatest errors [ulp], as the header states them."""

LIBM = ["tan", "asin", "acos", "atan", "sinh", "cosh", "asinh", "acosh", "atanh"]
LIBM += ["log", "log1p", "expm1", "erf"]
LIBM_OF_TWO = ["pow", "atan2", "fmod", "remainder", "hypot"]
PRIMITIVES = {
    "plus": "a + b",
    "times": "a * b",
    "over": "a / b",
    "minus": "-a",
    "fma": "v_fma(a, b, v_set(1.0))",
    "sqrt": "v_sqrt(a)",
    "fabs": "v_fabs(a)",
    "floor": "v_floor(a)",
    "ceil": "v_ceil(a)",
    "rint": "v_rint(a)",
    "min": "v_min(a, b)",
    "max": "v_max(a, b)",
    "sign": "v_sign(a)",
    "copysign": "v_copysign(a, b)",
    "lt": "v_from_mask(m_lt(a, b))",
    "le": "v_from_mask(m_le(a, b))",
    "eq": "v_from_mask(m_eq(a, b))",
    "ne": "v_from_mask(m_ne(a, b))",
    "and": "v_from_mask(m_and(m_from_value(a), m_from_value(b)))",
    "or": "v_from_mask(m_or(m_from_value(a), m_from_value(b)))",
    "not": "v_from_mask(m_not(m_from_value(a)))",
    "select": "v_select(m_lt(a, b), a, b)",
    "where0": "v_where0(m_lt(a, b), a)",
    "bits": "v_from_mask(m_from_bits(m_bits(m_lt(a, b))))",
    "any": "v_set(m_any(m_lt(a, b)))",
    "all": "v_set(m_all(m_lt(a, b)))",
    "first": "v_set(m_first(m_lt(a, b)))",
}
OF_VECTORS = {"any", "all", "first"}


def source(lanes: int) -> str:
    """Headers, and each function over whole arrays of two arguments."""
    called = {name: f"v_{name}(a)" for name in ("sin", "cos", "tanh", "exp", *LIBM)}
    called |= {name: f"v_{name}(a, b)" for name in LIBM_OF_TWO}
    texts = {f"call_{name}": f"return {text};" for name, text in (called | PRIMITIVES).items()}
    texts["call_sine"] = "V s, c; v_sincos(a, &s, &c); return s;"
    texts["call_cosine"] = "V s, c; v_sincos(a, &s, &c); return c;"
    lines = [f"#define ALIGHT_LANES {lanes}", HEADERS["vector.h"]]
    lines.append(HEADERS["vector_math.h"].replace('#include "vector.h"', ""))
    for name, text in texts.items():
        lines.append(f"V_INLINE V lanes_{name}(V a, V b) {{ (void)a, (void)b; {text} }}")
        lines.append(
            f"""void {name}(long n, const double *x, const double *y, double *out) {{
  double a[LANES] __attribute__((aligned(64))), b[LANES] __attribute__((aligned(64)));
  double r[LANES] __attribute__((aligned(64)));
  for (long i = 0; i < n; i += LANES) {{
    V_EACH(j) a[j] = x[i + j], b[j] = y[i + j];
    v_store(r, lanes_{name}(v_load(a), v_load(b)));
    V_EACH(j) out[i + j] = r[j];
  }}
}}"""
        )
    return "\n".join([*lines, "int fused(void) { return ALIGHT_FUSED; }\n"])


@cache
def library(lanes: int, flags: tuple[str, ...] = NATIVE) -> ctypes.CDLL:
    """The functions of one width."""
    return load(source(lanes), flags=flags)


def call(
    name: str,
    x: np.ndarray,
    y: np.ndarray | None = None,
    *,
    lanes: int = 8,
    flags: tuple[str, ...] = NATIVE,
) -> np.ndarray:
    """Results of a function; arguments are padded by copies of the last one to whole vectors."""
    count = len(x)
    padded = [np.pad(v, (0, -count % 8), mode="edge") for v in (x, x if y is None else y)]
    doubles = [np.ascontiguousarray(v, dtype=np.float64) for v in padded]
    out = np.empty(len(padded[0]))
    pointers = [v.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for v in (*doubles, out)]
    getattr(library(lanes, flags), f"call_{name}")(ctypes.c_long(len(out)), *pointers)
    return out[:count]


def same(a: np.ndarray, b: np.ndarray) -> bool:
    """Equal to the bit, every NaN the same."""
    nan = np.isnan(a) & np.isnan(b)
    return bool(np.all(nan | (a.view(np.uint64) == b.view(np.uint64))))


def worst(name: str, x: np.ndarray, got: np.ndarray) -> float:
    """Greatest error in units of the spacing of doubles at the exact result."""
    exact, greatest = getattr(mp, name), 0.0
    with mp.workdps(40):
        for argument, result in zip(x.tolist(), got.tolist(), strict=True):
            true = exact(mp.mpf(argument))
            if not true:
                assert result == 0
                continue
            spacing = mp.ldexp(1, max(int(mp.frexp(true)[1]), -1021) - 53)
            greatest = max(greatest, float(abs(mp.mpf(result) - true) / spacing))
    return greatest


def spread(limit: float, count: int = 2500) -> np.ndarray:
    """Arguments of both signs: dense over (-limit, limit), and over all scales down to 1e-320."""
    rng = np.random.default_rng(1)
    scales = np.exp(rng.uniform(np.log(1e-320), np.log(limit), count // 4))
    dense = np.linspace(-limit, limit, count) + rng.uniform(0, limit / count, count)
    return np.clip(np.concatenate([dense, scales, -scales]), -limit, limit)


def near_quarters(count: int = 500) -> np.ndarray:
    """Angles next to quarter turns, where sine or cosine is tiny, and a half beside them.

    There the reduced angle has an error of half a unit, and the sine half the angle's spacing.
    """
    n = np.random.default_rng(2).integers(-60000, 60000, count)
    quarters = n * (math.pi / 2)
    return np.concatenate([quarters, np.nextafter(quarters, 0), quarters + 0.5, quarters + 0.25])


ANGLES = np.concatenate(
    [spread(4.0), spread(1e3, 1000), spread(1e5, 1000), spread(1e9, 1000), near_quarters()]
)
ARGUMENTS = {
    "sin": ANGLES,
    "cos": ANGLES,
    "tanh": np.concatenate([spread(0.6), spread(22.0), spread(8e307, 100)]),
    "exp": np.concatenate([spread(1.0), spread(709.7), np.linspace(-745.1, -700, 200)]),
}
FUNCTIONS = pytest.mark.parametrize("name", list(ARGUMENTS))
EVERY_WIDTH = pytest.mark.parametrize("lanes", WIDTHS)
ANY = arrays(np.float64, 8, elements=st.floats(width=64))


@FUNCTIONS
def test_errors_stay_within_what_the_header_states(name):
    x = ARGUMENTS[name]
    assert 0.5 < worst(name, x, call(name, x)) <= STATED[name]


@FUNCTIONS
@given(st.data())
def test_errors_stay_within_what_the_header_states_wherever_one_looks(name, data):
    limit = {"sin": 1e9, "cos": 1e9, "tanh": 8e307, "exp": 709.7}[name]
    x = data.draw(arrays(np.float64, 8, elements=st.floats(-limit, limit)))
    assert worst(name, x, call(name, x)) <= STATED[name]


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="an x86 flag")
@FUNCTIONS
def test_without_fused_multiply_add_errors_stay_within_what_the_header_states(name):
    x = ARGUMENTS[name][::4]
    assert library(1, PLAIN).fused() == 0
    assert worst(name, x, call(name, x, lanes=1, flags=PLAIN)) <= STATED[name]


@given(ANY, ANY)
def test_every_width_gives_the_same_bits(x, y):
    if not library(1).fused():
        pytest.skip("this processor has no fused multiply-add")
    for name in (*ARGUMENTS, *LIBM, *LIBM_OF_TWO, *(PRIMITIVES.keys() - OF_VECTORS)):
        wide = call(name, x, y, lanes=8)
        assert all(same(wide, call(name, x, y, lanes=lanes)) for lanes in WIDTHS[:-1]), name


@FUNCTIONS
def test_every_width_gives_the_same_bits_over_many_arguments(name):
    if not library(1).fused():
        pytest.skip("this processor has no fused multiply-add")
    x = ARGUMENTS[name]
    wide = call(name, x, lanes=8)
    assert all(same(wide, call(name, x, lanes=lanes)) for lanes in WIDTHS[:-1])


@FUNCTIONS
@given(ANY, st.floats(width=64))
def test_a_lane_does_not_see_its_neighbours(name, x, neighbour):
    alone = [call(name, np.where(np.arange(8) == lane, x, neighbour))[lane] for lane in range(8)]
    assert same(call(name, x), np.array(alone))


@given(ANY)
def test_sine_and_cosine_come_out_the_same_together_and_alone(x):
    assert same(call("sine", x), call("sin", x))
    assert same(call("cosine", x), call("cos", x))


@EVERY_WIDTH
@given(x=ANY, angle=arrays(np.float64, 8, elements=st.floats(-1e15, 1e15)))
def test_sine_and_tanh_are_odd_and_cosine_is_even(lanes, x, angle):
    assert same(call("tanh", -x, lanes=lanes), -call("tanh", x, lanes=lanes))
    assert same(call("sin", -angle, lanes=lanes), -call("sin", angle, lanes=lanes))
    assert same(call("cos", -angle, lanes=lanes), call("cos", angle, lanes=lanes))


@given(arrays(np.float64, 8, elements=st.floats(-1e9, 1e9)))
def test_squares_of_sine_and_cosine_add_up_to_one(x):
    assert np.all(abs(call("sin", x) ** 2 + call("cos", x) ** 2 - 1) <= 4 * EPSILON)


@EVERY_WIDTH
@given(x=arrays(np.float64, 8, elements=st.floats(allow_nan=False, allow_infinity=False)))
def test_no_finite_angle_leads_out_of_the_unit_interval(lanes, x):
    for name in ("sin", "cos"):
        assert np.all(abs(call(name, x, lanes=lanes)) <= 1)


@EVERY_WIDTH
@given(x=ANY, y=ANY)
def test_tanh_grows_but_for_its_error_and_stays_within_one(lanes, x, y):
    low, high = (call("tanh", bound(x, y), lanes=lanes) for bound in (np.fmin, np.fmax))
    known = ~(np.isnan(x) | np.isnan(y))
    assert np.all((high - low)[known] >= -2 * STATED["tanh"] * EPSILON * abs(low[known]))
    assert np.all(abs(high[known]) <= 1)


SPECIAL = np.array([0.0, -0.0, 5e-324, -5e-324, 1e-310, np.inf, -np.inf, np.nan])
OF_SPECIAL = {
    "sin": [0.0, -0.0, 5e-324, -5e-324, 1e-310, np.nan, np.nan, np.nan],
    "cos": [1, 1, 1, 1, 1, np.nan, np.nan, np.nan],
    "tanh": [0.0, -0.0, 5e-324, -5e-324, 1e-310, 1, -1, np.nan],
    "exp": [1, 1, 1, 1, 1, np.inf, 0, np.nan],
}


@EVERY_WIDTH
@FUNCTIONS
def test_zeros_subnormal_numbers_infinities_and_nan(lanes, name):
    assert same(call(name, SPECIAL, lanes=lanes), np.array(OF_SPECIAL[name], dtype=float))


@EVERY_WIDTH
def test_exp_overflows_to_infinity_and_underflows_to_zero(lanes):
    x = np.array([709.782712893384, 709.7827128933841, 745.2, 1e18, 1e300])
    assert np.array_equal(np.isinf(call("exp", x, lanes=lanes)), [0, 1, 1, 1, 1])
    assert np.array_equal(call("exp", -x, lanes=lanes) == 0, [0, 0, 1, 1, 1])


@given(arrays(np.float64, 8, elements=st.floats(1.0, 20.0)))
def test_seldom_functions_are_those_of_the_c_library(above_one):
    for name in LIBM:
        x = 1 / above_one if name in ("asin", "acos", "atanh") else above_one
        with mp.workdps(40):
            true = [float(getattr(mp, name)(mp.mpf(v))) for v in x.tolist()]
        assert np.allclose(call(name, x), true, rtol=1e-15, atol=0), name


NUMPY: dict[str, Callable] = {
    "plus": np.add,
    "times": np.multiply,
    "over": np.divide,
    "minus": lambda a, b: -a,
    "sqrt": lambda a, b: np.sqrt(a),
    "fabs": lambda a, b: np.fabs(a),
    "floor": lambda a, b: np.floor(a),
    "ceil": lambda a, b: np.ceil(a),
    "rint": lambda a, b: np.rint(a),
    "min": lambda a, b: np.where(a < b, a, b),
    "max": lambda a, b: np.where(a > b, a, b),
    "sign": lambda a, b: np.where(a == 0, a, np.sign(a)),
    "copysign": np.copysign,
    "lt": np.less,
    "le": np.less_equal,
    "eq": np.equal,
    "ne": np.not_equal,
    "and": np.logical_and,
    "or": np.logical_or,
    "not": lambda a, b: np.logical_not(a),
    "select": lambda a, b: np.where(a < b, a, b),
    "where0": lambda a, b: np.where(a < b, a, 0.0),
    "bits": np.less,
    "pow": np.power,
    "atan2": np.arctan2,
    "fmod": np.fmod,
    "hypot": np.hypot,
}


@EVERY_WIDTH
@given(x=ANY, y=ANY)
def test_primitives_do_what_numpy_does(lanes, x, y):
    for name, function in NUMPY.items():
        with np.errstate(all="ignore"):
            expected = np.asarray(function(x, y), dtype=float)
        got = call(name, x, y, lanes=lanes)
        close = np.allclose(got, expected, rtol=1e-15, atol=0, equal_nan=True)
        assert close if name in LIBM_OF_TWO else same(got, expected), name


@EVERY_WIDTH
@given(x=ANY, y=ANY)
def test_masks_are_summed_up_vector_by_vector(lanes, x, y):
    def of_vector(name: str) -> list[float]:
        return call(name, x, y, lanes=lanes)[::lanes].tolist()

    less = (x < y).reshape(-1, lanes)
    assert of_vector("any") == less.any(axis=1).tolist()
    assert of_vector("all") == less.all(axis=1).tolist()
    assert of_vector("first") == [[*m, True].index(True) for m in less.tolist()]


def test_the_coefficients_are_those_of_the_exchange():
    assert minimax.table() in HEADERS["vector_math.h"]


@pytest.mark.skipif(util.find_spec("ziglang") is None, reason="ziglang is not installed")
@pytest.mark.parametrize("target", ["aarch64-linux-gnu", "aarch64-macos", "riscv64-linux-gnu"])
def test_other_processors_compile(target, tmp_path):
    (tmp_path / "lanes.c").write_text(source(1 if "riscv" in target else 2), "utf-8")
    command = [sys.executable, "-m", "ziglang", "cc", "-target", target, "-O1", "-Werror", "-Wall"]
    done = subprocess.run(
        [*command, "-c", "lanes.c", "-o", "lanes.o"], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
