"""The page within a notebook: in a frame of its own, so that neither disturbs the other."""

from __future__ import annotations

import html
from pathlib import Path

from uxsim_geo.analysis.link_states import link_times
from uxsim_geo.export.page.page import Run, page
from uxsim_geo.export.run_description import RunDescription
from uxsim_geo.files import replace_when_complete
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result

#: of the frame in the notebook, pixels
HEIGHT = 900


class InlinePage:
    """A page that a notebook shows where it is the value of a cell.

    text
        the whole page, as :func:`uxsim_geo.export.page.page.page` makes it
    """

    def __init__(self, text: str) -> None:
        self.text = text

    def _repr_html_(self) -> str:
        frame = f'width="100%" height="{HEIGHT}" style="border: 0" title="traffic report"'
        return f'<iframe {frame} srcdoc="{html.escape(self.text)}"></iframe>'

    def __repr__(self) -> str:
        return f"a page of {len(self.text) / 1e6:.1f} MB for a notebook, or to save(path)"

    def save(self, path: Path | str) -> None:
        """Write the page to a file; it takes its name when it is complete."""
        with replace_when_complete(Path(path)) as temporary:
            temporary.write_text(self.text, encoding="utf-8", newline="\n")


def explore(
    network: Network, result: Result, *, bin_s: float = 300.0, about: RunDescription | None = None
) -> InlinePage:
    """Map, curves and tables of a result, to look at in a notebook.

    ``bin_s`` is the length of a time step, s; ``about`` title, clock and facts to show with it.
    Errors as of :func:`uxsim_geo.analysis.link_states.link_times`, and RuntimeError where MapLibre
    GL JS is not installed.
    """
    run = Run(network, result, link_times(result, network, bin_s=bin_s))
    facts = {"seed": result.settings.seed, "duration_s": result.settings.duration}
    return InlinePage(page(run, about or RunDescription(None, network.notes, facts)))
