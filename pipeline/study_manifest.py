"""What the manifest of a study says of it: how it came about, and what it takes to repeat it."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.attribution import attribution, licence
from pipeline.config_file import plain_values, relative_name
from pipeline.config_keys import Reading
from pipeline.program import code_digest, machine, versions
from pipeline.runs import MANIFEST
from pipeline.study_config import StudyFile, study_of
from pipeline.study_folder import SOURCES, STUDY, StudyFolder
from pipeline.yaml_source import YamlSource, yaml_of
from uxsim_geo.errors import Fault, InputError

if TYPE_CHECKING:
    from pipeline.study import Study
    from pipeline.study_scenarios import Prepared


def facts(study: Study, prepared: Mapping[str, Prepared]) -> dict[str, Any]:
    """Return what is known of a study beside its times and results."""
    configs = [one.config for one in prepared.values()]
    return {
        "name": study.file.config.name,
        "command": list(study.command),
        **{name: vars(record) for name, record in study.files.items()},
        "scenarios": list(prepared),
        "edits": {name: list(one.edits) for name, one in prepared.items()},
        "seeds": study.seeds.done,
        "versions": versions(),
        "code": code_digest(),
        "machine": machine(),
        "attribution": "; ".join(dict.fromkeys(filter(None, map(attribution, configs)))),
        "licence": "; ".join(dict.fromkeys(filter(None, map(licence, configs)))),
        SOURCES: sorted({study.folder.sources(one.ingest).path.name for one in configs}),
        **_to_repeat(study),
    }


def _to_repeat(study: Study) -> dict[str, Any]:
    """Return study and base as they were written, and with all their keys.

    Paths start from the folders named with them.
    """
    file, root = study.file, study.folder.path
    keys = plain_values(file.config, file.reading.folder)
    base = plain_values(study.base, file.base.folder)
    return {
        "text": file.text,
        "config": {**keys, "scenarios": file.given.get("scenarios", {})},
        "folder": relative_name(file.reading.folder, root),
        "base_config": base,
        "base_document": _written(file, base),
        "base_folder": relative_name(file.base.folder, root),
    }


def _written(file: StudyFile, base: dict[str, Any]) -> dict[str, Any]:
    """Return the base as it was written, by which edits of its keys go, with its control file."""
    values: dict[str, Any] = deepcopy(file.base.document.values)
    simulate = values.get("simulate")
    if isinstance(simulate, dict) and isinstance(simulate.get("control"), str):
        simulate["control"] = base["simulate"]["control"]
    return values


def study_from(path: Path) -> StudyFile:
    """Return the study that a manifest describes; its base is that of the manifest too.

    Raises :class:`uxsim_geo.errors.InputError` for a file that is no manifest of a study, or of one
    that broke off before its first run.
    """
    folder = StudyFolder(path.parent)
    told = folder.read_manifest().study if path.name == MANIFEST else {}
    needed = {"text", "config", "folder", "base_document", "base_folder"}
    config = told.get("config", {})
    if not (needed <= told.keys() and {"name", "set", "seeds"} <= config.keys()):
        what = "is no manifest of a study that can be repeated: name runs/STUDY/manifest.json"
        raise InputError([Fault(what, str(path))])
    root = path.parent.resolve()
    document = yaml_of(told["text"], f"{path}, {STUDY}")
    # what the command line said then, and the base that is in the manifest
    document.values |= {name: config[name] for name in ("name", "set", "seeds")}
    document.values["base"] = str(path.resolve())
    study = Reading(document, (root / told["folder"]).resolve())
    base = YamlSource(str(path), deepcopy(told["base_document"]))
    at = Reading(base, (root / told["base_folder"]).resolve())
    return study_of(path, study, told["text"], at)
