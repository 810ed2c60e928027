"""MapLibre GL JS, which draws the page's map, from the installed package ``maplibre``.

The package is not imported: only its files are read, so its own code never runs.
"""

from __future__ import annotations

import re
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

PACKAGE = "maplibre"
FOLDER = "srcjs"
SCRIPT, STYLE = "maplibre-gl.js", "maplibre-gl.css"

#: tells developer tools of a file that is not there
SOURCE_MAP = re.compile(r"\n//# sourceMappingURL=\S+\s*$")


class MapLibre(NamedTuple):
    """The text of the library's script and style sheet, fit to stand in a page's tags."""

    script: str
    style: str


def maplibre() -> MapLibre:
    """Read the library; raises RuntimeError, with what to install, where it is not there."""
    spec = find_spec(PACKAGE)
    folders = list(spec.submodule_search_locations or ()) if spec else []
    for folder in (Path(name) / FOLDER for name in folders):
        if (folder / SCRIPT).is_file() and (folder / STYLE).is_file():
            script = (folder / SCRIPT).read_text(encoding="utf-8")
            style = (folder / STYLE).read_text(encoding="utf-8")
            return MapLibre(_fit_for_tag(SOURCE_MAP.sub("\n", script)), _fit_for_tag(style))
    raise RuntimeError(
        f"MapLibre GL JS was not found: {SCRIPT} and {STYLE} belong to the Python package "
        f"{PACKAGE}; install the version that requirements.lock names"
    )


def _fit_for_tag(text: str) -> str:
    """Keep a string within the code from ending the tag that the code stands in."""
    return re.sub(r"</(?=script|style)", r"<\\/", text, flags=re.IGNORECASE)
