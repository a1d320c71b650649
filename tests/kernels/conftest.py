"""A cache folder of a test's own."""

from __future__ import annotations

import pytest

from alight.kernels import toolchain


@pytest.fixture
def cache(monkeypatch, tmp_path):
    """An empty cache folder, and a process that has warned of nothing yet."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(toolchain, "_told", set())
    monkeypatch.setattr(toolchain, "_passing", [])
    return toolchain.cache_folder()
