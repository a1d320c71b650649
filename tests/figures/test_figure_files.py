"""Figures reach the disk whole, in the format of their suffix, and cost nothing until drawn."""

import subprocess
import sys

import pytest
from matplotlib.figure import Figure
from PIL import Image

from alight import AlightError
from alight.errors import UnknownName
from alight.figures import save


@pytest.fixture
def figure() -> Figure:
    fig = Figure(figsize=(2.0, 1.0))
    fig.subplots().plot([0, 1], [0, 1])
    return fig


@pytest.mark.parametrize(
    ("suffix", "beginning"),
    [(".png", b"\x89PNG"), (".pdf", b"%PDF"), (".svg", b"<?xml"), (".PNG", b"\x89PNG")],
)
def test_the_suffix_chooses_the_format(figure, tmp_path, suffix, beginning):
    path = save(figure, tmp_path / f"figure{suffix}")
    assert path.read_bytes().startswith(beginning)
    assert list(tmp_path.iterdir()) == [path]


def test_pixels_come_at_150_dpi_unless_told_otherwise(figure, tmp_path):
    with Image.open(save(figure, tmp_path / "a.png")) as image:
        assert image.size == (300, 150)
    with Image.open(save(figure, tmp_path / "b.png", dpi=50)) as image:
        assert image.size == (100, 50)


def test_an_unknown_suffix_is_refused_with_those_that_are_known(figure, tmp_path):
    with pytest.raises(UnknownName, match=r"'xls'.*pdf, png"):
        save(figure, tmp_path / "figure.xls")


def test_a_missing_folder_is_named_and_nothing_is_left_behind(figure, tmp_path):
    with pytest.raises(AlightError, match="nowhere"):
        save(figure, tmp_path / "nowhere" / "figure.png")
    assert not list(tmp_path.iterdir())


def test_a_failed_drawing_leaves_the_old_file_as_it_was(figure, tmp_path):
    path = save(figure, tmp_path / "figure.png")
    old = path.read_bytes()
    figure.axes[0].set_title(r"$\nosuchsymbol$")
    with pytest.raises(ValueError, match="nosuchsymbol"):
        save(figure, path)
    assert path.read_bytes() == old
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("imported", "absent"),
    [("alight, alight.scenarios", "matplotlib"), ("alight.figures", "matplotlib.pyplot")],
)
def test_matplotlib_is_imported_for_drawing_only_and_pyplot_never(imported, absent):
    program = f"import sys, {imported}; sys.exit({absent!r} in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0
