"""Writes what the code says into pages: the configuration with its schema, layers and columns."""

from __future__ import annotations

import inspect
import json
import typing
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from types import MappingProxyType

from pydantic import AwareDatetime, BaseModel, Field, create_model
from pydantic.fields import FieldInfo

from pipeline.config import Config
from pipeline.config_file import iterate_keys, sections_in
from pipeline.config_keys import ChosenLinks, Period
from pipeline.demand_config import PlacesSection, ZonesSection
from pipeline.edits_config_demand import ChosenTrips
from pipeline.edits_config_network import LinkAttributes
from pipeline.edits_config_study import StudyEdit
from pipeline.study_config import StudyConfig
from uxsim_geo.export.columns import LAYERS, Layer
from uxsim_geo.export.comparison.columns import OF_ALL, OF_SCENARIO

HEAD = """# Configuration

One YAML file a run. Unknown keys are errors, paths are relative to the file, every key can also be
set on the command line: `--set simulate.duration_s=3600`. Entries of a list are counted from 0:
`--set ingest.trips.0.factor=2`, which also reaches trips that are written without a list. This page
is made from the models in `pipeline/config.py` and `pipeline/*_config*.py` by
`docs/generate.py`; a JSON schema for editors lies beside it. What measures of control do, with an
example of each, stands in [control.md](control.md).
"""

STUDY_HEAD = """# Keys of a study

One YAML file a study. Unknown keys are errors, and paths are relative to the file. What edits do,
with examples, stands in [Scenarios](studies_edits.md), how runs are done in
[Running studies](studies_running.md); sections that a configuration has too are told in
[Configuration](config.md). This page is made from the models in `pipeline/study_config.py` and
`pipeline/edits_config_study.py` by `docs/generate.py`; a JSON schema for editors,
`study.schema.json`, lies beside it.
"""

#: keys that many sections share, said once under these headings at the end
SHARED: dict[type[BaseModel], str] = {
    ChosenLinks: "Chosen links",
    Period: "Periods",
    PlacesSection: "Places of demand",
    ZonesSection: "Zones",
    LinkAttributes: "Attributes of links",
    ChosenTrips: "Chosen trips",
}

#: of a study, whose edits are read one by one so that each fault is told with its scenario
STUDY = create_model(
    "Study",
    __base__=StudyConfig,
    __doc__=StudyConfig.__doc__,
    name=(str | None, Field(None, description=StudyConfig.model_fields["name"].description)),
    scenarios=(
        dict[str, tuple[StudyEdit, ...]],
        Field({}, description=StudyConfig.model_fields["scenarios"].description),
    ),
)

#: what stands between these lines of pages about layers is made here
BEGIN = "<!-- made by docs/generate.py from uxsim_geo/export/columns.py -->"
END = "<!-- end of what docs/generate.py makes -->"

#: no section is told on another page
NOWHERE: Mapping[type[BaseModel], str] = MappingProxyType({})

TYPE_NAMES: dict[object, str] = {
    str: "text",
    float: "number",
    int: "whole number",
    bool: "`true` or `false`",
    typing.Any: "text, number or pairs",
    Path: "path",
    AwareDatetime: "date and time",
}


def configuration_page() -> str:
    """Return the page of all keys: section by section, with type, default and meaning."""
    shared = (_titled(model, title) for model, title in SHARED.items())
    return "\n".join([HEAD + _section(Config, ""), *shared]) + "\n"


def configuration_schema() -> str:
    """Return the JSON schema of a configuration."""
    return json.dumps(Config.model_json_schema(), indent=1, ensure_ascii=False) + "\n"


def study_page() -> str:
    """Return the page of all keys of a study, except those that a configuration has too."""
    known: dict[type[BaseModel], str] = {}
    for dotted, key in iterate_keys():
        for section in sections_in(key.annotation):
            known.setdefault(section, dotted)
    return STUDY_HEAD + _section(STUDY, "", known) + "\n"


def study_schema() -> str:
    """Return the JSON schema of a study."""
    return json.dumps(STUDY.model_json_schema(), indent=1, ensure_ascii=False) + "\n"


#: layers that pages tell, by the names of the pages
PAGES: dict[str, dict[str, Layer]] = {
    "results.md": LAYERS,
    "studies_results.md": {
        **{f"{part}_SCENARIO": layer for part, layer in OF_SCENARIO.items()},
        **OF_ALL,
    },
}


def results_page(page: str, layers_of_page: dict[str, Layer] = LAYERS) -> str:
    """Return a page about layers with its part of layers and columns made anew."""
    before, begin, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    layers = "\n".join(_layer(name, layer) for name, layer in layers_of_page.items())
    return f"{before}{begin}\n\n{layers}\n{end}{after}"


def _layer(name: str, layer: Layer) -> str:
    lines = [
        f"### {name}",
        "",
        layer.what,
        "",
        "| column | unit | what | empty |",
        "|---|---|---|---|",
    ]
    lines += [
        f"| `{column.name}` | {column.unit} | {column.what} | {column.empty} |"
        for column in layer.columns
    ]
    return "\n".join(lines) + "\n"


def _section(
    model: type[BaseModel], above: str, elsewhere: Mapping[type[BaseModel], str] = NOWHERE
) -> str:
    """Return the table of a section's keys and the sections in it.

    ``elsewhere``: sections that the page of the configuration has, and their titles there.
    """
    lines = ["| key | type | default | meaning |", "|---|---|---|---|"]
    below = []
    shared = [base for base in SHARED if issubclass(model, base) and model is not base]
    for base in shared:
        keys = ", ".join(f"`{name}`" for name in base.model_fields)
        lines.append(f"| {keys} | | | {_reference(base, elsewhere)} |")
    for field, key in model.model_fields.items():
        if any(field in base.model_fields for base in shared):
            continue
        name = key.alias or field
        meaning = (key.description or "").replace("|", "\\|")
        meaning += _see(key, elsewhere)
        lines.append(f"| `{name}` | {_type_name(key.annotation)} | {_default(key)} | {meaning} |")
        below += [
            _titled(section, f"{above}{name}", f"{above}{name}.", elsewhere)
            for section in sections_in(key.annotation)
            if section not in SHARED and section not in elsewhere
        ]
    return "\n" + "\n".join(lines + below)


def _titled(
    model: type[BaseModel],
    title: str,
    above: str = "",
    elsewhere: Mapping[type[BaseModel], str] = NOWHERE,
) -> str:
    text = inspect.cleandoc(model.__doc__ or "").replace("``", "`")
    return f"\n## {title}\n\n{text}\n{_section(model, above, elsewhere)}"


def _see(key: FieldInfo, elsewhere: Mapping[type[BaseModel], str]) -> str:
    titles = [elsewhere[part] for part in sections_in(key.annotation) if part in elsewhere]
    return f"; see [{titles[0]}](config.md#{titles[0].replace('.', '')})" if titles else ""


def _reference(model: type[BaseModel], elsewhere: Mapping[type[BaseModel], str] = NOWHERE) -> str:
    title, page = SHARED[model], "config.md" if elsewhere else ""
    return f"see [{title}]({page}#{title.lower().replace(' ', '-')})"


def _type_name(annotation: object) -> str:
    arguments = [part for part in typing.get_args(annotation) if part is not type(None)]
    origin = typing.get_origin(annotation)
    if origin is typing.Literal:
        return " or ".join(f"`{choice}`" for choice in arguments)
    if origin is typing.Annotated:
        return _type_name(arguments[0])
    if origin is tuple and typing.get_origin(arguments[0]) is typing.Literal:
        return f"list out of {_type_name(arguments[0]).replace(' or ', ', ')}"
    if origin is tuple:
        return f"list of {_type_name(arguments[0])}s" if ... in arguments else "pair"
    if origin is dict:
        return f"pairs of text and {_type_name(arguments[1])}"
    if origin is not None:
        return " or ".join(map(_type_name, arguments))
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return f"section, {_reference(annotation)}" if annotation in SHARED else "section"
    return TYPE_NAMES[annotation]


def _default(key: FieldInfo) -> str:
    value = key.default
    if key.is_required():
        return "required"
    if isinstance(value, BaseModel):
        return "as below"
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, datetime):
        return f"`{value.isoformat()}`"
    if isinstance(value, tuple) and any(isinstance(one, BaseModel) for one in value):
        told = (one.model_dump(exclude_defaults=True) for one in value)
        return f"`[{', '.join(str(keys).replace(chr(39), '') for keys in told)}]`"
    if isinstance(value, tuple):
        return f"`[{', '.join(map(str, value))}]`"
    return "–" if value is None else f"`{value}`"


if __name__ == "__main__":
    folder = Path(__file__).parent
    (folder / "config.md").write_text(configuration_page(), encoding="utf-8")
    (folder / "config.schema.json").write_text(configuration_schema(), encoding="utf-8")
    (folder / "study_keys.md").write_text(study_page(), encoding="utf-8")
    (folder / "study.schema.json").write_text(study_schema(), encoding="utf-8")
    for name, layers in PAGES.items():
        text = (folder / name).read_text(encoding="utf-8")
        (folder / name).write_text(results_page(text, layers), encoding="utf-8")
