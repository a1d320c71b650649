"""Ten minutes under load: nothing lost, time kept as the host says, memory flat."""

import pytest

from tests.live.soak import soak

TEN_MINUTES = 600.0
GROWTH = 16 * 2**20
"""Bytes by which a process may grow in eight minutes: a leak of a row a tick would be a GB."""


@pytest.mark.slow
def test_a_soak_on_a_loaded_machine_loses_no_sample_and_no_memory(tmp_path):
    seen = soak(tmp_path, TEN_MINUTES)
    assert seen["recorded"] == seen["ticks"] > 0
    assert seen["contiguous"] and not seen["lost"]
    assert seen["gains_recorded"] == seen["changes"]
    for part, (first, last) in seen["memory"].items():
        assert last - first < GROWTH, part
