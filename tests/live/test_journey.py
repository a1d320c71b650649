"""An operator's run on the page: started, steered, recorded, and reproduced to the bit."""

import io

import numpy as np
import pytest
from PIL import Image

from alight.live.replay import first_difference, resimulate
from alight.simulation.recording_events import EventKind
from tests.live.journey import ALPHA1, SIZE, journey


@pytest.mark.slow
def test_a_run_steered_on_the_page_is_recorded_and_reproduced(tmp_path):
    done = journey(tmp_path)
    recording = done.recording
    assert recording["Lambda"].any()
    (change,) = [event for event in recording.events if event.kind == EventKind.GAINS]
    assert change.changes == {"law.gains.alpha1": ALPHA1}
    assert change.row == done.tick - done.began
    eta_m, e_m, u_f = (recording[name] for name in ("eta_m", "e_m", "u_f"))
    law, speed = recording.scenario["law"]["gains"], recording["x_m_dot_measured"]
    for row, alpha1 in ((change.row - 1, law["alpha1"]), (change.row, ALPHA1)):
        expected = -speed[row] + alpha1 * np.tanh(e_m[row]) + law["alpha2"] * u_f[row]
        assert eta_m[row] == pytest.approx(expected, rel=1e-9, abs=1e-12), row
    assert first_difference(recording, resimulate(recording)) is None
    for picture in done.pictures.values():
        with Image.open(io.BytesIO(picture)) as shown:
            assert shown.size == tuple(SIZE.values())
            assert len(shown.convert("RGB").getcolors(1 << 24)) > 500  # neither blank nor an error
