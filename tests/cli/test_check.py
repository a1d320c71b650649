"""``alight check``: page, files, exit code."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.cli.command import OWN_ARM, SHORT, invoke


def test_a_certified_scenario_ends_with_0_and_prints_the_answers_first():
    result = invoke("check", OWN_ARM)
    assert result.exit_code == 0 and result.stderr == ""
    head = " ".join(result.stdout[:900].split())
    assert head.startswith("Own arm against a plate on a spring: certified")
    for question in ("Is it stable with these gains?", "How hard can it strike?"):
        assert question in head
    for title in ("What is assumed", "What is proven", "Bounds in newtons", "Theorem 1 as printed"):
        assert title in result.stdout


def test_what_is_not_certified_ends_with_1_and_is_kept_whole(tmp_path):
    folder = tmp_path / "kept"
    result = invoke("check", "experiment-1", *SHORT, "--out", str(folder))
    assert result.exit_code == 1 and "not certified" in result.stdout
    assert {path.name for path in folder.iterdir()} == {
        "certificate.json",
        "certificate.md",
        "lyapunov.png",
        "region.png",
    }
    kept = json.loads((folder / "certificate.json").read_text("utf-8"))
    assert kept["scenario"] == "experiment-1" and kept["certified"] is False
    assert (folder / "certificate.md").read_text("utf-8").startswith("# Certificate of experiment")
    for picture in folder.glob("*.png"):
        with Image.open(picture) as image:
            assert min(image.size) > 300 and len(np.unique(np.asarray(image.convert("L")))) > 10


def test_json_is_all_that_stdout_holds():
    result = invoke("check", OWN_ARM, *SHORT, "--json")
    found = json.loads(result.stdout)
    assert found["certified"] is True and result.exit_code == 0
    loc = found["proven"]["conditions"][0]
    assert loc["number"] == "LOC" and loc["holds"] and loc["margin"] > 0


@pytest.mark.parametrize(
    ("text", "args", "says"),
    [
        ('extends = "experiment-1"\nlaw.type = "exact-model"\n', (), "needs an adaptive law"),
        ('extends = "experiment-1"\n', ("--set", "assumptions.m_l=3.0"), "m_l and m_u = 3, 2.7"),
        ('extends = "experiment-1"\n', ("--set", "assumptions.sigma_J=1.0"), "no pose has both"),
        (
            'extends = "experiment-1"\n',
            ("--set", "law.theta_r.upper=[2e5, 8e2, 3.0, 5e2, 3.0, 0.01, 2e2, 1.2, 3.0, 2e5]"),
            "law.theta_r: its box admits p1 = ",
        ),
    ],
)
def test_what_admits_no_certificate_is_refused_with_2_and_leaves_nothing(
    text, args, says, tmp_path: Path
):
    file, folder = tmp_path / "mine.toml", tmp_path / "out"
    file.write_text(text)
    result = invoke("check", str(file), *args, "--out", str(folder))
    assert result.exit_code == 2 and result.stdout == "" and not folder.exists()
    assert says in " ".join(result.stderr.split())


def test_a_scenario_without_assumptions_is_told_what_they_are(tmp_path: Path):
    whole = Path(OWN_ARM).read_text("utf-8").partition("[assumptions]")[0]
    file = tmp_path / "silent.toml"
    file.write_text(whole)
    result = invoke("check", str(file))
    assert result.exit_code == 2
    assert "assumptions: missing" in result.stderr and "zeta_K" in result.stderr
