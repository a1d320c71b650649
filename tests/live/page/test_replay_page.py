"""The same page on a recording: it plays, seeks, and shows the gains as they were."""

import contextlib
import json
import re
import subprocess
import sys

import pytest
from playwright.sync_api import expect

import alight
from alight.live.shared.commands import Kind
from tests.cli.command import environment
from tests.live.bench import ask, bench, wait_for, with_value
from tests.live.browser import browser

expect.set_options(timeout=30_000)


@contextlib.contextmanager
def replayed(path):
    """Address of a page on a recording."""
    command = [sys.executable, "-c", "from alight.cli import main; main()", "replay", str(path)]
    process = subprocess.Popen(
        [*command, "--port", "0"], env=environment(), stdout=subprocess.PIPE, text=True
    )
    try:
        yield re.search(r"http://\S+", process.stdout.readline()).group()
    finally:
        process.terminate()
        process.wait()
        process.stdout.close()


@pytest.fixture(scope="module")
def chromium():
    with browser() as made:
        yield made


def opened(chromium, url):
    page = chromium.new_page(viewport={"width": 1280, "height": 800})
    page.goto(url)
    page.wait_for_selector(".al-page")
    return page


def value(page, key):
    return page.locator(f"#field-{key} input[type=text]")


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A live run in which alpha1 was changed by hand."""
    folder = tmp_path_factory.mktemp("bench")
    with bench(folder, parts=("host", "record")) as made:
        link = made.link()
        report = made.session.folder / "recorder.json"
        wait_for(report.exists)
        ask(link, Kind.START)
        began = link.ring.head
        wait_for(lambda: link.ring.head > began + 1000)
        ask(link, Kind.PARAMETERS, values=with_value(made.session.scenario, alpha1=31.0))
        wait_for(lambda: link.ring.head > began + 2000)
        ask(link, Kind.STOP)
        ask(link, Kind.RESET)
        wait_for(lambda: json.loads(report.read_bytes())["state"] == "idle")
        (path,) = made.recordings.glob("*.mcap")
        return path


def test_events_are_places_to_go_to_and_gains_are_as_they_were(recorded, chromium):
    with replayed(recorded) as url:
        page = opened(chromium, url)
        # One that merely looks cannot change what was.
        expect(value(page, "law-gains-alpha1")).to_be_disabled()
        change = page.locator("[data-seek]:has(.gains)")
        at = float(change.locator("time").inner_text().split()[0])
        page.locator("[data-seek]").first.click()
        expect(value(page, "law-gains-alpha1")).to_have_value("55")
        change.click()
        expect(value(page, "law-gains-alpha1")).to_have_value("31")
        expect(page.locator(".al-time b")).to_have_text(f"{at:.3f} s")
        expect(page.locator(".al-certificate")).to_contain_text("+6.6")
        page.close()


def test_it_plays_to_its_end_and_from_its_beginning(recorded, chromium):
    end = alight.Recording.load(recorded).t[-1]
    with replayed(recorded) as url:
        page = opened(chromium, url)
        page.locator("select[aria-label=Speed]").select_option("20.0")
        page.get_by_role("button", name="Play").click()
        expect(page.locator(".al-time b")).to_have_text(f"{end:.3f} s")
        slider = page.locator("alight-seek input")
        slider.focus()
        page.keyboard.press("Home")
        expect(page.locator(".al-time b")).to_have_text("0.000 s")
        page.close()


def test_a_simulated_run_is_shown_too(tmp_path, chromium):
    path = tmp_path / "run.mcap"
    scenario = alight.load_scenario("experiment-1", {"duration": 1.0, "steady_state": 0.2})
    alight.simulate(scenario).save(path)
    with replayed(path) as url:
        page = opened(chromium, url)
        expect(page.get_by_role("status")).to_have_text("RECORDED")
        expect(value(page, "law-gains-k2")).to_have_value("0.47")
        page.close()


def test_what_is_no_recording_is_refused(tmp_path):
    path = tmp_path / "not.mcap"
    path.write_bytes(b"nothing")
    command = [sys.executable, "-c", "from alight.cli import main; main()", "replay", str(path)]
    done = subprocess.run(command, env=environment(), capture_output=True, text=True)
    assert done.returncode == 2
    assert "not.mcap" in done.stderr
