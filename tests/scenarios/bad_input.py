"""Scenarios that must be refused, and what the message has to say."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import pytest


class Bad(NamedTuple):
    """A scenario file and settings with one mistake."""

    name: str
    says: tuple[str, ...]
    """Parts of the message: field, value, remedy."""
    settings: tuple[str, ...] = ()
    text: str | bytes = 'extends = "experiment-1"\n'

    def write(self, folder: Path) -> Path:
        """Write the file."""
        path = folder / "mine.toml"
        content = self.text if isinstance(self.text, bytes) else self.text.encode()
        path.write_bytes(content)
        return path


def setting(text: str, *says: str) -> Bad:
    return Bad(text[:60], says, (text,))


def file(name: str, text: str | bytes, *says: str) -> Bad:
    return Bad(name, says, (), text)


NUMBERS = [
    setting("plant.body.m=nan", "plant.body.m = nan", "should be a finite number"),
    setting("plant.body.k_s=inf", "plant.body.k_s = inf", "should be a finite number"),
    setting("plant.arm.l1=-inf", "plant.arm.l1 = -inf", "should be"),
    setting("plant.body.m=-1.5", "plant.body.m = -1.5", "should be greater than 0"),
    setting("plant.body.damping=-1", "plant.body.damping = -1", "greater than or equal to 0"),
    setting("plant.body.m=heavy", "plant.body.m = 'heavy'", "should be a valid number"),
    setting("plant.contact.K_I=-1", "plant.contact.K_I = -1", "should be greater than 0"),
    setting("start.x_r=[nan, 0.4]", "start.x_r.0 = nan", "should be a finite number"),
    setting("law.e_f=nan", "law.e_f = nan", "should be a finite number"),
    setting("law.gains.k1=0", "law.gains.k1 = 0", "should be greater than 0"),
    setting("law.theta_dk.initial=nan", "law.theta_dk.initial = nan", "a finite number"),
    setting("duration=nan", "duration = nan", "should be a finite number"),
    setting("duration=0", "duration = 0", "should be greater than 0"),
    setting("duration=1e12", "duration = 1e+12", "must be at most"),
    setting("seed=-1", "seed = -1", "greater than or equal to 0"),
    setting("substeps=2.5", "substeps = 2.5", "valid integer"),
    setting("testbed.sample_rate=0", "testbed.sample_rate = 0", "should be greater than 0"),
]
SHAPES = [
    setting("plant.body.m=[1.0, 2.0]", "plant.body.m = [1.0, 2.0]", "should be a valid number"),
    setting("law.gains.k3=95.0", "law.gains.k3 = 95.0", "should be a list"),
    setting("law.gains.k3=[95.0]", "law.gains.k3.1: missing"),
    setting("law.gains.k3=[1.0, 2.0, 3.0]", "law.gains.k3 = [1.0, 2.0, 3.0]", "at most 2 items"),
    setting("law.Gamma_r=[1.0, 2.0]", "law.Gamma_r", "needs 10 entries"),
    setting("law.theta_r.lower=[1.0]", "law.theta_r", "the same number of entries"),
    setting("plant.body=3", "plant.body = 3", "should be a table"),
    setting("law=3", "law = 3", "should be a table"),
    setting("start.x_r.first=1", "start.x_r.first", "x_r is a value and not a table"),
]
MEANING = [
    setting("start.x_r=[2.0, 0.1]", "start.x_r = [2.0, 0.1]", "the arm reaches between"),
    setting("target.x_md=5", "target.x_md, target.x_rd2 = [5.0, ", "the arm reaches between"),
    Bad(
        "an outstretched arm",
        ("start.x_r = [0.6, 0.0]", "the arm reaches between", "J is singular there"),
        ("plant.arm.l1=0.3", "plant.arm.l2=0.3", "start.x_r=[0.6, 0.0]"),
    ),
    Bad(
        "a folded arm",
        ("start.x_r = [0.0, 0.0]", "borders excluded (J is singular there)"),
        ("plant.arm.l1=0.3", "plant.arm.l2=0.3", "start.x_r=[0.0, 0.0]"),
    ),
    Bad(
        "inverted bounds",
        ("law.theta_dk: lower = 0.5 must lie below upper = 0.1",),
        ("law.theta_dk.lower=0.5", "law.theta_dk.upper=0.1"),
    ),
    Bad(
        "an estimate out of its bounds",
        ("law.theta_dk: initial = 7.0 must lie between lower = ", "and upper = 2.0"),
        ("law.theta_dk.initial=7.0", "law.theta_dk.upper=2.0"),
    ),
    setting("plant.arm.p1=1e-6", "plant.arm: p1 = 1e-06", "needs (p1 - p2) p2 > p3^2"),
    setting("steady_state=1e3", "steady_state = 1000.0 must not be longer than duration"),
]
NAMES = [
    setting("plant.body.mass=3", "plant.body.mass: unknown name", "correct its spelling"),
    setting("law.gain=3", "law.gain: unknown name", "correct its spelling"),
    setting("phantom.a.b=3", "phantom: unknown name"),
    setting("law.type=gentle", "law.type = 'gentle'", "one of: exact-model, force-limiting"),
    setting("law.type=nowhere:Law", "law.type = 'nowhere:Law'", "No module named 'nowhere'"),
    setting("law.type=json:loads", "law.type = 'json:loads'", "not a subclass of alight.Law"),
    setting("law.type=json:none", "law.type = 'json:none'", "has no attribute 'none'"),
    setting("law.type=alight:PlainLaw", "PlainLaw does not say what its initial_state, tick is"),
    setting("law.model=3", "law.model: is that of the scenario; remove it"),
    setting("plant.contact.type=glue", "plant.contact.type = 'glue'", "'kelvin-voigt'"),
    setting("start.elbow=left", "start.elbow = 'left'", "'+' or '-'"),
    setting("plant.arm.plane=tilted", "plant.arm.plane = 'tilted'", "'horizontal' or 'vertical'"),
    setting("extends=experiment-2", "extends: describes the file and cannot be set"),
]
FILES = [
    file("no TOML", "duration = = 3\n", "is not valid TOML", "line 1"),
    file("not UTF-8", 'title = "Stoß"\n'.encode("latin-1"), "byte 0xdf at position 12", "UTF-8"),
    file("binary", bytes(range(128)), "not valid TOML"),
    file("empty", "", *(f"{t}: missing" for t in ("plant", "testbed", "start", "target", "law"))),
    file(
        "tables with holes",
        "[plant.arm]\nl1 = 0.3\n[start]\nx_m = 0.2\n",
        *("plant.arm.l2: missing", "plant.body: missing", "start.x_r: missing", "law: missing"),
    ),
    file(
        "a law without a type",
        'extends = "experiment-1"\nlaw = { value = { e_f = 0.0 } }\n',
        *("law.type: missing", "force-limiting"),
    ),
    file(
        "a contact without a type",
        'extends = "experiment-1"\n[plant]\ncontact = { value = { K_I = 1e5 } }\n',
        *("plant.contact.type: missing",),
    ),
    file(
        "a source of an unknown kind",
        'extends = "experiment-1"\nduration = { value = 3.0, guessed = "by me" }\n',
        *("duration: guessed beside its value", "published or assumed"),
    ),
    file(
        "two sources",
        'extends = "experiment-1"\nduration = { value = 3.0, published = "(1)", assumed = "x" }\n',
        *("duration: published, assumed beside its value", "one of"),
    ),
    file(
        "a source that is no text",
        'extends = "experiment-1"\nduration = { value = 3.0, published = 42 }\n',
        "duration.published = 42: must be a text",
    ),
    file("a parent that is nowhere", 'extends = "base.toml"\n', "extends = 'base.toml'", "no file"),
    file("a parent that is a number", "extends = 1\n", "extends = 1", "name of a scenario"),
    file("its own parent", 'extends = "mine.toml"\n', "extends itself", "mine.toml -> "),
]

CASES = [*NUMBERS, *SHAPES, *MEANING, *NAMES, *FILES]
each_bad_input = pytest.mark.parametrize("bad", CASES, ids=[case.name for case in CASES])
