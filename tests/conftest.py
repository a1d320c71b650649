"""How Hypothesis searches: the same examples on every machine, and no clock in the verdict.

``pytest --hypothesis-profile=search`` draws other examples, and many more of them.
"""

from hypothesis import settings

# Building a CasADi graph takes milliseconds on a quiet machine and far longer on a loaded one.
settings.register_profile("suite", deadline=None, max_examples=40, derandomize=True)
settings.register_profile("search", deadline=None, max_examples=1000, print_blob=True)
settings.load_profile("suite")
