"""One page steers at any time, whatever pages do."""

from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from alight.live.page.steering import Steering

PAGES = st.sampled_from("abcd")


class Pages(RuleBasedStateMachine):
    def __init__(self):
        super().__init__()
        self.steering, self.open, self.told = Steering(), set(), []
        self.steering.listen(self.told.append)

    @rule(page=PAGES)
    def come(self, page):
        alone = not any(self.steering.steers(p) for p in self.open)
        self.steering.join(page, "127.0.0.1")
        self.open.add(page)
        assert not alone or self.steering.steers(page)

    @rule(page=PAGES)
    def go(self, page):
        held = self.steering.steers(page)
        self.steering.leave(page)
        self.open.discard(page)
        assert not held or self.steering.holder == ""

    @rule(page=PAGES)
    def end(self, page):
        self.steering.forget(page)
        self.open.discard(page)

    @rule(page=PAGES)
    def take(self, page):
        before = [p for p in "abcd" if self.steering.steers(p)]
        self.steering.take(page)
        after = [p for p in "abcd" if self.steering.steers(p)]
        assert after == ([page] if page in self.open else before)

    @invariant()
    def at_most_one_open_page_steers(self):
        steering = [p for p in "abcd" if self.steering.steers(p)]
        assert len(steering) <= 1
        assert set(steering) <= self.open
        assert self.steering.watching == len(self.open) - len(steering)


TestPages = Pages.TestCase
