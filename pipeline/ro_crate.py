"""A run described for archives: RO-Crate metadata beside its manifest.

The crate follows RO-Crate 1.1 (https://w3id.org/ro/crate/1.1) and its profile for runs of programs,
Process Run Crate 0.5 (https://w3id.org/ro/wfrun/process/0.5): the folder is a dataset, every file
of it an entity, every stage an action of the program, from the files it read to those it wrote.
"""

from __future__ import annotations

import json
import mimetypes
from collections.abc import Iterator
from datetime import datetime, timedelta
from pathlib import PurePath
from typing import Any
from urllib.parse import quote

from pipeline.runs import CONFIG, MANIFEST, FileRecord, Manifest, RunFolder, StageRecord
from uxsim_geo.files import replace_when_complete

METADATA = "ro-crate-metadata.json"
CRATE = "https://w3id.org/ro/crate/1.1"
PROFILE = "https://w3id.org/ro/wfrun/process/0.5"
PROGRAM = "#uxsim-geo"

#: types of files that Python's table lacks
TYPES = {
    ".gpkg": "application/geopackage+sqlite3",
    ".parquet": "application/vnd.apache.parquet",
    ".yaml": "application/yaml",
}

Entity = dict[str, Any]


def write_crate(folder: RunFolder, manifest: Manifest) -> None:
    """Describe a run in its folder, in one move."""
    text = json.dumps(crate_of(manifest), indent=1, ensure_ascii=False)
    with replace_when_complete(folder / METADATA) as path:
        path.write_text(f"{text}\n", encoding="utf-8")


def crate_of(manifest: Manifest) -> Entity:
    """Return the metadata of a run as JSON-LD; all times are those of the manifest."""
    files = _files(manifest)
    actions = [_action(name, stage, files) for name, stage in manifest.stages.items()]
    sources = {_source_id(r): r for s in manifest.stages.values() for r in _foreign(s, files)}
    return {
        # the term is schema.org's; the context of 1.1 was written before it
        "@context": [f"{CRATE}/context", {"sha256": "https://schema.org/sha256"}],
        "@graph": [
            _descriptor(),
            _root(manifest, files, actions),
            {
                "@id": PROFILE,
                "@type": "CreativeWork",
                "name": "Process Run Crate",
                "version": "0.5",
            },
            _program(manifest),
            *(_file(name, record) for name, record in files.items()),
            {"@id": MANIFEST, "@type": "File", "encodingFormat": "application/json"},
            *(_source(id_, record) for id_, record in sorted(sources.items())),
            *actions,
        ],
    }


def _descriptor() -> Entity:
    return {
        "@id": METADATA,
        "@type": "CreativeWork",
        "about": {"@id": "./"},
        "conformsTo": {"@id": CRATE},
    }


def _root(manifest: Manifest, files: dict[str, FileRecord], actions: list[Entity]) -> Entity:
    run = manifest.run
    ended = max(action.get("endTime", "") for action in actions)
    return {
        "@id": "./",
        "@type": "Dataset",
        "conformsTo": {"@id": PROFILE},
        "name": run["name"],
        "description": f"Traffic simulation {run['name']}: settings, tables and results.",
        "datePublished": ended,
        "license": run.get("licence") or "not stated; the licences of the sources apply",
        **({"creditText": run["attribution"]} if run.get("attribution") else {}),
        "hasPart": [{"@id": _id(name)} for name in (*files, MANIFEST)],
        "mentions": [{"@id": action["@id"]} for action in actions],
    }


def _program(manifest: Manifest) -> Entity:
    versions = manifest.run["versions"]
    others = [f"{name} {version}" for name, version in versions.items() if name != "uxsim-geo"]
    return {
        "@id": PROGRAM,
        "@type": "SoftwareApplication",
        "name": "uxsim-geo",
        "softwareVersion": versions["uxsim-geo"],
        "softwareRequirements": others,
    }


def _action(name: str, stage: StageRecord, files: dict[str, FileRecord]) -> Entity:
    failed = bool(stage.problems)
    read = [_id(r.path) for r in stage.inputs.values() if r.path in files]
    read += [_source_id(record) for record in _foreign(stage, files)]
    return {
        "@id": f"#{name}",
        "@type": "CreateAction",
        "name": name,
        "instrument": {"@id": PROGRAM},
        "object": [{"@id": id_} for id_ in dict.fromkeys(read)],
        "result": [{"@id": _id(name)} for name in stage.outputs],
        **_times(stage),
        "actionStatus": {
            "@id": f"http://schema.org/{'Failed' if failed else 'Completed'}ActionStatus"
        },
        **({"error": "; ".join(stage.problems)} if failed else {}),
    }


def _times(stage: StageRecord) -> Entity:
    """Return begin and end; nothing of a stage that broke off."""
    if not stage.started:
        return {}
    ended = datetime.fromisoformat(stage.started) + timedelta(seconds=stage.wall_s)
    return {"startTime": stage.started, "endTime": ended.isoformat(timespec="seconds")}


def _files(manifest: Manifest) -> dict[str, FileRecord]:
    """Return the records of all files of the run by their names in its folder."""
    files = {CONFIG: FileRecord(**manifest.run["config_file"])}
    for stage in manifest.stages.values():
        files |= stage.outputs
    return files


def _foreign(stage: StageRecord, files: dict[str, FileRecord]) -> Iterator[FileRecord]:
    """Yield what the stage read from elsewhere."""
    yield from (record for record in stage.inputs.values() if record.path not in files)


def _file(name: str, record: FileRecord) -> Entity:
    return {"@id": _id(name), "@type": "File", "name": name, **_content(record)}


def _source(id_: str, record: FileRecord) -> Entity:
    """Describe a file that is no part of the crate, by its name and content alone."""
    name = PurePath(record.path).name
    return {"@id": id_, "@type": "CreativeWork", "name": name, **_content(record)}


def _content(record: FileRecord) -> Entity:
    kind = TYPES.get(PurePath(record.path).suffix) or mimetypes.guess_type(record.path)[0]
    return {
        "contentSize": str(record.size),
        "encodingFormat": kind or "application/octet-stream",
        "sha256": record.sha256,
    }


def _id(name: str) -> str:
    return quote(name)


def _source_id(record: FileRecord) -> str:
    return f"#source-{record.sha256[:16]}-{quote(PurePath(record.path).name)}"
