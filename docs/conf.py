"""How Sphinx makes the site of these pages: ``make site``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from uxsim_geo.version import __version__

if TYPE_CHECKING:
    from sphinx.application import Sphinx

project = "uxsim-geo"
author = "the uxsim-geo developers"
release = __version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.viewcode"]
html_theme = "furo"
html_title = f"uxsim-geo {release}"
html_show_copyright = False

# anchors of headings, as links within and between pages name them
myst_heading_anchors = 3
exclude_patterns = ["generate.py", "pictures.py"]

autodoc_typehints = "signature"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "undoc-members": False}
python_use_unqualified_type_names = True
# types are known by several names: that of their module, and that of the package
suppress_warnings = ["ref.python"]


def setup(app: Sphinx) -> None:
    """Called by Sphinx: docstrings pass through here before they are read."""
    app.connect("autodoc-process-docstring", _define_all_terms)


def _define_all_terms(*arguments: object) -> None:
    """Give terms of a list that say all by themselves an empty definition, in place.

    Docstrings list columns or fields, each with its meaning indented below, or alone where the
    name is enough; reStructuredText wants the former throughout.
    """
    lines = arguments[-1]
    assert isinstance(lines, list)
    blocks = "\n".join(lines).split("\n\n")
    lines[:] = "\n\n".join(map(_with_definitions, blocks)).split("\n")


def _with_definitions(block: str) -> str:
    lines = block.split("\n")
    is_term = [bool(line) and not line[0].isspace() for line in lines]
    if not is_term[0] or not any(line[:1].isspace() for line in lines):
        return block
    found = []
    for line, term, followed_by_term in zip(lines, is_term, [*is_term[1:], False], strict=True):
        found += [line, "    \\ "] if term and followed_by_term else [line]
    return "\n".join(found)
