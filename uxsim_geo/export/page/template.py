"""A page from its template: code of ours and of the map's library, everything else escaped."""

from __future__ import annotations

from importlib.resources import files
from typing import Any, NamedTuple

from uxsim_geo.export.page.libraries import maplibre

#: where the files of the report page lie
FOLDER = "uxsim_geo.export.page"


class Template(NamedTuple):
    """Package with the template, its name there, style sheets, and scripts in their order.

    Style sheets and scripts lie in that package, or in :data:`FOLDER`.
    """

    package: str
    name: str
    styles: tuple[str, ...]
    scripts: tuple[str, ...]


def rendered(template: Template, **values: Any) -> str:
    """The template with everything in it; what is not marked as safe is escaped.

    Raises RuntimeError where MapLibre GL JS is not installed.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined

    library = maplibre()
    environment = Environment(
        loader=PackageLoader(template.package, ""),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template(template.name).render(
        styles=[library.style, *(_text(template.package, name) for name in template.styles)],
        scripts=[library.script, *(_text(template.package, name) for name in template.scripts)],
        **values,
    )


def _text(package: str, name: str) -> str:
    own = files(package) / name
    found = own if own.is_file() else files(FOLDER) / name
    return found.read_text(encoding="utf-8")
