"""Sphinx: the site, built without a network and with warnings as errors."""

import dataclasses
import re
from importlib.metadata import version as version_of
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx
from sphinx.util.logging import getLogger

from alight.symbolic.parameters import quantities

project = "Alight"
author = "The Alight authors"
copyright = f"2026, {author}"
release = version = version_of("alight")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    "sphinx-mathjax-offline",
    "sphinxcontrib.bibtex",
]
exclude_patterns = ["_build", "results/*"]  # results.md includes what stands there
default_role = "py:obj"  # `name` in a docstring links to what it names

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
bibtex_bibfiles = ["references.bib"]

autosummary_generate = True
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
napoleon_google_docstring = False
napoleon_use_rtype = False

html_theme = "furo"
html_title = f"Alight {version}"
html_static_path = ["_static"]
html_css_files = ["tables.css"]
# Without its menu MathJax never looks for the parts that it keeps on another host.
mathjax3_config = {"options": {"enableMenu": False}}

LOADED = re.compile(r"<(?:script|link|img|iframe|source|video)\b[^>]*?\b(?:src|href)=\"([^\"]+)\"")


def warn_of_foreign_hosts(app: Sphinx, failure: Exception | None) -> None:
    """Warn of each thing that a page loads from another host."""
    if failure or app.builder.format != "html":
        return
    for page in sorted(Path(app.outdir).rglob("*.html")):
        for address in LOADED.findall(page.read_text("utf-8")):
            if re.match(r"(?:\w+:)?//", address):
                getLogger(__name__).warning("%s loads %s", page.name, address)


def tabulate_parameters(
    app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]
) -> None:
    """Put unit and meaning of its parameters, stated on the fields' types, under a class."""
    if not (isinstance(obj, type) and dataclasses.is_dataclass(obj) and quantities(obj)):
        return
    lines += ["", ".. list-table::", "   :header-rows: 1", ""]
    lines += ["   * - parameter", "     - unit", "     - meaning"]
    for parameter, known in quantities(obj).items():
        lines += [f"   * - ``{parameter}``", f"     - {known.unit}", f"     - {known.meaning}"]
    lines.append("")


def drop_aliases(
    app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]
) -> None:
    """Leave out what Python says of the fields of a named tuple: their number."""
    if lines and lines[0].startswith("Alias for field number"):
        lines.clear()


def setup(app: Sphinx) -> None:
    """Add the tables of parameters, and look at every page once all of them are written."""
    app.connect("autodoc-process-docstring", drop_aliases)
    app.connect("autodoc-process-docstring", tabulate_parameters)
    app.connect("build-finished", warn_of_foreign_hosts)
