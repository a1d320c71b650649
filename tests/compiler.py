"""Whether this machine can compile C, and the mark of tests that need it."""

from __future__ import annotations

import pytest

from alight.kernels.compilers import CompilerUnavailable, find_compiler


def has_compiler() -> bool:
    """Whether this machine can compile C."""
    try:
        find_compiler()
    except CompilerUnavailable:
        return False
    return True


NEEDS_COMPILER = pytest.mark.skipif(not has_compiler(), reason="no C compiler on this machine")
