"""Pictures of a certificate show the arrays they are given."""

from __future__ import annotations

import numpy as np
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure

from alight.figures import lyapunov, stable_region

T = np.linspace(0.0, 2.0, 401)
CONTACT = (T > 0.5) & (T < 0.7) | (T > 1.0)


def functions() -> Figure:
    values = {"V": 2 + np.exp(-T), "V_r": np.exp(-4 * T)}
    return lyapunov(T, values, {"V_r": {"bound": np.ones_like(T)}}, CONTACT)


def test_each_function_has_its_panel_with_its_bounds_and_a_closer_look():
    axes = functions().get_axes()
    assert len(axes) == 4
    lines = [[line for line in ax.get_lines() if len(line.get_xdata()) > 2] for ax in axes]
    assert sorted(len(found) for found in lines) == [1, 1, 2, 2]
    np.testing.assert_array_equal(lines[0][0].get_ydata(), 2 + np.exp(-T))
    assert {ax.get_xlim()[1] for ax in axes} == {0.5, 2.0}
    assert [ax.get_yscale() for ax in axes[::2]] == ["linear", "log"]  # a narrow range is linear


def test_contact_is_shaded_phase_by_phase():
    whole = functions().get_axes()[0]
    spans = sorted((p.get_x(), p.get_x() + p.get_width()) for p in whole.patches)
    np.testing.assert_allclose(spans, [(0.505, 0.7), (1.005, 2.0)], atol=0.006)


def test_the_plane_shows_borders_a_filled_region_and_points():
    alpha1, k1 = np.logspace(0, 2, 30), np.logspace(-1, 1, 20)
    a, b = np.meshgrid(alpha1, k1)
    fig = stable_region(
        alpha1,
        k1,
        {"LOC": 30 * b - a, "VTX": 10 * b - a},
        {"the scenario": (55.0, 2.0), "nearest": (10.0, 2.0)},
    )
    (ax,) = fig.get_axes()
    assert not any(isinstance(c, QuadMesh) for c in ax.collections)
    border = np.vstack([p.vertices for p in ax.collections[0].get_paths()])
    np.testing.assert_allclose(border[:, 0], 30 * border[:, 1], rtol=0.05)
    dots = [(line.get_xdata()[0], line.get_ydata()[0]) for line in ax.get_lines()]
    assert dots == [(55.0, 2.0), (10.0, 2.0)]
    legend = [text.get_text() for text in ax.get_legend().get_texts()]
    assert legend == ["LOC: holds on its left", "VTX holds", "the scenario", "nearest"]
