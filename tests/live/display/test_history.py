"""The browser's memory of the rows: nothing lost at full rate, no spike lost in any summary."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

from alight.live.page.stream import STATIC_PATH
from tests.live.display.served import serve

FULL, COARSE = 1 << 18, 256

REMEMBER = (Path(__file__).parent / "remember.js").read_text()


@pytest.fixture(scope="module")
def run(browser: Browser) -> Iterator[Callable[..., dict[str, Any]]]:
    with serve(lambda: None) as server:
        page: Page = browser.new_page()
        page.goto(f"{server.url}{STATIC_PATH}/history.js")
        yield lambda *given: page.evaluate(REMEMBER, [f"{STATIC_PATH}/history.js", *given])
        page.close()


def values(rows: np.ndarray) -> np.ndarray:
    """What the browser generates for these rows."""
    # JavaScript multiplies doubles: beyond 2^53 it rounds, and so does this.
    found = np.float32(np.fmod(rows.astype(float) * 2654435761.0, 2.0**32) / 2.0**32)
    return np.where(rows % 997 == 0, np.nan, found)


def bounds(known: np.ndarray, a: int, b: int) -> tuple[float, float]:
    part = known[max(a, 0) : b]
    return float(np.nanmin(part)), float(np.nanmax(part))


def test_every_value_stays_as_it_came(run: Callable) -> None:
    rows = np.array([1000, 1001, 1994, 5000, 11_999])
    found = run([[1000, 11_000]], [[int(r), int(r) + 1] for r in rows])
    np.testing.assert_array_equal(np.array(found["at"], dtype=float), values(rows))
    assert found["end"] == 12_000


def test_ranges_hold_every_value_and_little_more(run: Callable) -> None:
    count = FULL + 150_000  # the oldest are kept as minima and maxima only
    known = values(np.arange(count))
    rng = np.random.default_rng(3)
    spans = [1, 3, 17, 63, 64, 300, 1023, 1024, 5000, 120_000]
    asked = [[int(a), int(a) + span] for span in spans for a in rng.integers(0, count - span, 12)]
    found = run([[0, count]], asked)
    assert found["oldestFull"] == count - FULL
    for (a, b), (low, high) in zip(asked, found["ranges"], strict=True):
        part = known[a:b]
        wide = known[max(0, a // COARSE * COARSE) : (b + COARSE) // COARSE * COARSE]
        if not np.isnan(part).all():
            assert np.nanmin(wide) <= low <= np.nanmin(part), (a, b)
            assert np.nanmax(wide) >= high >= np.nanmax(part), (a, b)


def test_rows_that_were_skipped_are_a_gap_and_repeated_ones_count_once(run: Callable) -> None:
    found = run([[100, 50], [120, 60], [400, 20]], [[179, 180], [180, 400], [400, 401], [0, 100]])
    assert found["end"] == 420
    at = np.array(found["at"], dtype=float)
    np.testing.assert_array_equal(
        at, [*values(np.array([179])), np.nan, *values(np.array([400])), np.nan]
    )
    low, high = bounds(values(np.arange(420)), 179, 180)
    assert found["ranges"][0] == [low, high]
    assert found["ranges"][3] == [None, None]


def test_a_gap_longer_than_what_is_kept_forgets_what_was_before(run: Callable) -> None:
    far = 40_000 * COARSE
    found = run([[0, 3000], [far, 100]], [[far - 5000, far], [far, far + 100], [0, 3000]])
    assert found["ranges"][0] == [None, None]
    assert found["ranges"][1] == list(bounds(values(np.arange(far + 100)[far:]), 0, 100))
    assert found["ranges"][2] == [None, None]
