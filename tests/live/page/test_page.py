"""Chromium drives the page of a real bench, as an operator would."""

import json
import os
import signal
from contextlib import ExitStack

import numpy as np
import pytest
from playwright.sync_api import Page, expect

import alight
from alight.live.shared.commands import Kind, Outcome
from alight.live.shared.status import State
from tests.live.bench import ask, columns, gather, state_of, supervised, wait_for
from tests.live.browser import browser

PATIENCE = 30_000
expect.set_options(timeout=PATIENCE)


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    with supervised(tmp_path_factory.mktemp("bench")) as made:
        yield made


@pytest.fixture(scope="module")
def chromium():
    with browser() as made:
        yield made


@pytest.fixture(scope="module")
def open_page(bench, chromium):
    """Opens pages; afterwards no page complained, and none asked another host for anything."""
    said, asked = [], []
    wait_for(lambda: answers(bench))
    with ExitStack() as stack:

        def opened() -> Page:
            page = chromium.new_page(viewport={"width": 1280, "height": 800})
            stack.callback(page.close)
            page.set_default_timeout(PATIENCE)
            page.on("console", lambda message: said.append(message.text))
            page.on("pageerror", lambda error: said.append(str(error)))
            page.on("request", lambda request: asked.append(request.url))
            page.on("websocket", lambda socket: asked.append(socket.url))
            page.goto(bench.url)
            page.wait_for_selector(".al-page")
            return page

        yield opened
    own = bench.url.partition("://")[2]
    foreign = [u for u in asked if not u.startswith((f"http://{own}", f"ws://{own}", "data:"))]
    assert foreign == []
    assert said == []


@pytest.fixture(scope="module")
def shared(open_page):
    return open_page()


@pytest.fixture
def page(shared, bench):
    """A page that steers a bench which is ready."""
    made = shared
    if button(made, "Take control").is_visible():
        button(made, "Take control").click()
    expect(made.get_by_text("You steer")).to_be_visible()
    link = bench.link()
    if state_of(link) is State.RUNNING:
        made.keyboard.press("Escape")
        expect(badge(made)).to_have_text("STOPPED")
    if state_of(link) is not State.READY:
        button(made, "Reset").click()
    expect(badge(made)).to_have_text("READY")
    button(made, "Gains").click()
    if button(made, "Revert").is_enabled():
        button(made, "Revert").click()
    expect(apply(made)).to_be_disabled()
    return made


def answers(bench):
    import httpx

    try:
        return httpx.get(f"{bench.url}live/layout.json", trust_env=False).status_code == 200
    except httpx.TransportError:
        return False


def badge(page):
    return page.get_by_role("status")


def number(page, key):
    return page.locator(f"#field-{key} input[type=text]")


def button(page, name):
    return page.get_by_role("button", name=name, exact=True)


def apply(page):
    return page.locator(".al-actions button.primary")


def commands(link, since):
    return [
        (number, link.commands.kind_of(number), json.loads(link.commands.text_of(number)))
        for number in range(since + 1, link.commands.done + 1)
    ]


def test_a_run_is_started_watched_and_stopped(page, bench):
    link = bench.link()
    first = link.ring.head
    button(page, "Start").click()
    expect(badge(page)).to_have_text("RUNNING")
    touched = columns(link, "Lambda")
    wait_for(lambda: gather(link, max(first, link.ring.head - 200), 100)[:, touched].any())
    expect(page.locator(".al-rec b")).to_contain_text("experiment-1-")
    page.keyboard.press("Escape")
    expect(badge(page)).to_have_text("STOPPED")
    assert state_of(link) is State.STOPPED
    row = gather(link, link.ring.head, 1)[0]
    assert not row[columns(link, "torque")].any()
    expect(page.locator(".al-log")).to_contain_text("stop")
    button(page, "Reset").click()
    expect(badge(page)).to_have_text("READY")


def test_escape_stops_from_within_a_field(page):
    button(page, "Start").click()
    expect(badge(page)).to_have_text("RUNNING")
    number(page, "law-gains-k1").focus()
    page.keyboard.press("Escape")
    expect(badge(page)).to_have_text("STOPPED")


def test_a_gain_takes_effect_at_the_tick_that_the_page_names(page, bench):
    link = bench.link()
    button(page, "Start").click()
    expect(badge(page)).to_have_text("RUNNING")
    before = link.commands.done
    number(page, "law-gains-alpha1").fill("31")
    expect(apply(page)).to_be_enabled()
    certificate = page.locator(".al-certificate")
    expect(certificate).to_contain_text("+6.6")
    expect(certificate).to_contain_text("holds")
    apply(page).click()
    told = page.locator(".al-panel > .al-outcome")
    expect(told).to_contain_text("in force since tick")
    (done, kind, text) = commands(link, before)[0]
    assert kind is Kind.PARAMETERS
    assert text["values"] == {"law.gains.alpha1": 31.0}
    tick = link.commands.answer(done).tick
    expect(told).to_contain_text(f"in force since tick {tick},")
    rows = gather(link, tick - 5, 10)
    assert rows[:, columns(link, "command")].ravel().tolist() == [before] * 5 + [done] * 5
    for row in rows:
        e_m, x_m_dot, u_f = (row[columns(link, n)][0] for n in ("e_m", "x_m_dot_measured", "u_f"))
        law = bench.session.scenario.law.gains
        alpha1 = 31.0 if row[columns(link, "command")][0] == done else law.alpha1
        wanted = -x_m_dot + alpha1 * np.tanh(e_m) + law.alpha2 * u_f
        assert row[columns(link, "eta_m")][0] == pytest.approx(wanted, rel=1e-9, abs=1e-12)
    expect(apply(page)).to_be_disabled()
    put_back(page)


def put_back(page):
    number(page, "law-gains-alpha1").fill("55")
    expect(apply(page)).to_be_enabled()
    apply(page).click()
    expect(apply(page)).to_be_disabled()


def test_a_slider_moves_its_field_and_revert_takes_it_back(page):
    slider = page.locator("#field-law-gains-k2 input[type=range]")
    slider.focus()
    page.keyboard.press("PageUp")
    expect(number(page, "law-gains-k2")).not_to_have_value("0.47")
    expect(apply(page)).to_be_enabled()
    button(page, "Revert").click()
    expect(number(page, "law-gains-k2")).to_have_value("0.47")
    expect(apply(page)).to_be_disabled()


def test_what_is_invalid_is_told_at_its_field_and_cannot_be_applied(page, bench):
    link = bench.link()
    before = link.commands.submitted
    number(page, "law-gains-k1").fill("-3")
    expect(page.locator("#field-law-gains-k1 .note")).to_have_text("must be > 0")
    expect(apply(page)).to_be_disabled()
    expect(button(page, "Save as…")).to_be_disabled()
    button(page, "Revert").click()
    button(page, "Target").click()
    number(page, "law-target-x_md").fill("0.9")
    expect(page.locator(".al-panel > .al-outcome")).to_contain_text("reach")
    expect(apply(page)).to_be_disabled()
    button(page, "Revert").click()
    assert link.commands.submitted == before


def test_a_draft_is_saved_and_not_over_another_file(page, bench):
    number(page, "law-gains-alpha1").fill("33")
    expect(apply(page)).to_have_text("Apply 1 change")
    for words, again in (("Save", False), ("Replace it", True)):
        button(page, "Save as…").click()
        page.locator(".al-dialog input").fill("mine.toml")
        button(page, "Save").last.click()
        if again:
            expect(page.locator(".al-dialog")).to_contain_text("is there already")
            button(page, words).click()
        expect(page.locator(".al-dialog")).to_have_count(0)
    saved = alight.load_scenario(bench.recordings / "mine.toml")
    assert saved.law.gains.alpha1 == 33.0
    assert saved.plant == bench.session.scenario.plant
    button(page, "Revert").click()


def test_a_kick_and_another_law_reach_the_host(page, bench):
    link = bench.link()
    button(page, "Start").click()
    expect(badge(page)).to_have_text("RUNNING")
    button(page, "Disturb").click()
    number(page, "kick-0").fill("12")
    before = link.commands.done
    button(page, "Kick").click()
    wait_for(lambda: link.commands.done > before)
    done, kind, _ = commands(link, before)[0]
    assert kind is Kind.KICK
    rows = gather(link, link.commands.answer(done).tick, 120)
    pushed = rows[:, columns(link, "kick")]
    assert (pushed[:100] == [12.0, 0.0]).all()
    assert not pushed[100:].any()
    button(page, "Law").click()
    page.locator("[data-law='2']").click()
    expect(page.locator(".al-certificate")).to_contain_text("does not adapt")
    apply(page).click()
    expect(page.locator(".al-law b")).to_have_text("exact-model")
    assert gather(link, link.ring.head, 1)[0, columns(link, "law")] == [2]
    page.locator("[data-law='0']").click()
    apply(page).click()
    expect(page.locator(".al-law b")).to_have_text("force-limiting")


def test_a_refusal_of_the_host_is_told(page, bench):
    assert ask(bench.link(), Kind.KICK, values=(1, 1, 1)).outcome is Outcome.REFUSED
    expect(page.locator(".al-log .refused").first).to_contain_text("refused")


def test_two_pages_one_steers(page, open_page, bench):
    other = open_page()
    expect(other.get_by_text("Watching")).to_be_visible()
    expect(button(other, "Start")).to_be_disabled()
    expect(number(other, "law-gains-k1")).to_be_disabled()
    # What a page pretends is of no use: the server knows who steers.
    other.evaluate("document.querySelectorAll('[disabled]').forEach((e) => (e.disabled = false))")
    before = bench.link().commands.submitted
    button(other, "Start").click()
    number(other, "law-gains-k1").fill("9")
    expect(badge(other)).to_have_text("READY")
    button(other, "Take control").click()
    expect(other.get_by_text("You steer")).to_be_visible()
    expect(page.get_by_text("Watching")).to_be_visible()
    expect(number(page, "law-gains-k1")).to_be_disabled()
    assert bench.link().commands.submitted == before
    button(other, "Start").click()
    expect(badge(page)).to_have_text("RUNNING")
    # Stopping is everybody's.
    page.locator("#stop").click()
    expect(badge(other)).to_have_text("STOPPED")
    other.close()
    button(page, "Take control").click()
    expect(page.get_by_text("You steer")).to_be_visible()


def test_control_is_free_when_the_page_that_had_it_has_gone(page, open_page):
    first = open_page()
    button(first, "Take control").click()
    expect(first.get_by_text("You steer")).to_be_visible()
    first.close()
    expect(page.locator(".al-steer")).to_contain_text("nobody steers")
    second = open_page()
    expect(second.get_by_text("You steer")).to_be_visible()
    second.close()


def test_light_or_dark_is_remembered(page):
    shown = "getComputedStyle(document.body).backgroundColor"
    dark = page.evaluate(shown)
    button(page, "◐").click()
    assert page.evaluate(shown) != dark
    page.reload()
    page.wait_for_selector(".al-page")
    assert page.evaluate("document.documentElement.dataset.theme") == "light"
    button(page, "◐").click()


def test_a_killed_host_is_told_and_another_one_can_be_had(page, bench):
    button(page, "Start").click()
    expect(badge(page)).to_have_text("RUNNING")
    bench.kill("host")
    banner = page.get_by_role("alert")
    expect(banner).to_contain_text("HOST NOT RUNNING")
    expect(banner).to_contain_text("safe by their own watchdog")
    expect(button(page, "Start")).to_be_disabled()
    hosts = len(bench.session.hosts)
    button(page, "Restart host").click()
    wait_for(lambda: len(bench.session.hosts) > hosts)
    expect(badge(page)).to_have_text("READY")
    expect(banner).to_be_hidden()
    button(page, "Start").click()
    expect(badge(page)).to_have_text("RUNNING")


def test_without_a_supervisor_the_page_goes_on_and_says_so(page, bench):
    """The last test of this bench."""
    bench.kill("supervisor")
    expect(page.get_by_role("alert")).to_contain_text("supervisor is gone")
    button(page, "Start").click()
    expect(badge(page)).to_have_text("RUNNING")
    os.kill(bench.pid("host"), signal.SIGSTOP)
    expect(page.get_by_role("alert")).to_contain_text("HOST NOT RUNNING")
    os.kill(bench.pid("host"), signal.SIGCONT)
    expect(badge(page)).to_have_text("RUNNING")
