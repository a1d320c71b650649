"""The main job: both experiments, every claim, every file."""

import json

import pandas as pd
import pytest

from alight.reproduction import reproduce
from alight.reproduction.claims import FACTOR
from alight.simulation import Recording


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    folder = tmp_path_factory.mktemp("results") / "new"
    shares = []
    reproduction = reproduce(folder, progress=lambda share, text: shares.append(share))
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    return folder, reproduction


def test_every_claim_is_judged_in_order(done):
    _, reproduction = done
    assert [claim.number for claim in reproduction.claims] == list(range(1, 15))
    assert reproduction.complete


def test_a_published_error_holds_exactly_when_it_is_within_the_factor(done):
    """The verdicts on 1-6 follow from the recordings, by an independent calculation."""
    _, reproduction = done
    published = [0.216e-3, 0.737e-3, 2.56e-6, 0.376e-3, 0.075e-3, 5e-6]
    runs = reproduction.runs
    frames = [recording.to_pandas() for recording in (runs.recording_1, runs.recording_2)]
    peaks = [
        frame[frame.index > frame.index[-1] - 2.0][name].abs().max()
        for frame in frames
        for name in ("e_r1", "e_r2", "e_m")
    ]
    for claim, peak, target in zip(reproduction.claims, peaks, published, strict=False):
        assert claim.ratio == pytest.approx(peak / target)
        assert claim.holds == (1 / FACTOR <= peak / target <= FACTOR)


def test_all_files_are_there_and_open(done):
    folder, reproduction = done
    names = {path.name for path in folder.iterdir()}
    figures = {f"figure-{n}.png" for n in range(4, 9)} | {"plan-view.png", "strike.gif"}
    records = {f"experiment-{n}.{kind}" for n in (1, 2) for kind in ("parquet", "mcap")}
    assert names == figures | records | {"report.md", "claims.json"}
    written = json.loads((folder / "claims.json").read_text())["claims"]
    assert [entry["holds"] for entry in written] == [c.holds for c in reproduction.claims]
    frame = pd.read_parquet(folder / "experiment-1.parquet")
    assert (frame["e_m"] == reproduction.runs.recording_1["e_m"]).all()
    loaded = Recording.load(folder / "experiment-2.mcap")
    assert (loaded.samples == reproduction.runs.recording_2.samples).all()
    for figure in figures:
        assert (folder / figure).stat().st_size > 10_000


def test_the_report_shows_every_claim_and_every_assumed_value(done):
    folder, reproduction = done
    text = (folder / "report.md").read_text()
    for claim in reproduction.claims:
        row = next(line for line in text.splitlines() if line.startswith(f"| {claim.number} |"))
        assert row.endswith("| yes |" if claim.holds else "| **no** |")
    assert "| `plant.body.m` | assumed |" in text
    assert "| `law.gains.k1` | published | (42) |" in text


def test_nothing_is_written_without_a_folder(tmp_path, monkeypatch, done):
    monkeypatch.chdir(tmp_path)
    _, first = done
    again = reproduce()
    assert list(tmp_path.iterdir()) == []
    assert again.claims == first.claims  # the same seed gives the same verdicts
