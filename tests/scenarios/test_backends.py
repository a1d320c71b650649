"""The same bits on every backend, for every scenario that ships."""

from __future__ import annotations

import pytest

import alight
from alight.errors import UnknownName
from alight.kernels.compilers import CompilerUnavailable, find_compiler
from tests.cli.command import OWN_ARM

SHORT = ["duration=0.5", "steady_state=0.1"]


def compiler() -> str | None:
    try:
        return find_compiler()
    except CompilerUnavailable:
        return None


@pytest.mark.skipif(compiler() is None, reason="no C compiler on this machine")
@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("experiment-1", []),
        ("experiment-1", ["law.gains.alpha1=10.0", "law.gains.alpha3=1.0"]),
        ("experiment-2", []),
        ("experiment-1", ["law.type=exact-model", "testbed.delay=true"]),
        (OWN_ARM, ["testbed.transducer.noise=1e-6", "plant.contact.K_I=2e4"]),
        (OWN_ARM, ["law.gains.alpha1=5000"]),
    ],
)
def test_virtual_machine_and_compiled_c_agree_bit_by_bit(name, settings):
    scenario = alight.load_scenario(name, [*SHORT, *settings])
    vm, c = (alight.simulate(scenario, backend=backend) for backend in ("vm", "c"))
    assert vm.samples.tobytes() == c.samples.tobytes()
    assert vm.verdict == c.verdict


def test_an_unknown_backend_is_refused_with_the_known_ones():
    with pytest.raises(UnknownName, match="unknown backend 'gpu'; one of: auto, c, lanes, vm"):
        alight.simulate(OWN_ARM, backend="gpu")  # type: ignore[arg-type]


def test_progress_rises_to_the_end():
    shares: list[float] = []
    scenario = alight.load_scenario(OWN_ARM, ["duration=2.5"])
    alight.simulate(scenario, progress=shares.append)
    assert shares == sorted(shares) and len(shares) > 1
    assert shares[-1] == 1.0 and shares[0] > 0
