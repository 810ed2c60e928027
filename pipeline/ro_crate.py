"""Runs and studies described for archives: what RO-Crate metadata beside their manifests hold.

The crates follow RO-Crate 1.1 (https://w3id.org/ro/crate/1.1) and its profile for runs of programs,
Process Run Crate 0.5 (https://w3id.org/ro/wfrun/process/0.5): the folder is a dataset, every file
of it an entity, what was done an action of the program, from the files it read to those it wrote.
"""

from __future__ import annotations

import json
import mimetypes
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Any
from urllib.parse import quote

from pipeline.runs import MANIFEST, FileRecord
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


@dataclass(frozen=True)
class Crate:
    """What a folder is described by.

    about
        what its manifest says: name, versions, attribution, licence
    description
        a sentence
    ended
        when it was complete
    files
        by their names in the folder, beside the manifest
    actions
        what was done
    others
        entities beside files and actions
    parts
        ids of the others that belong to the dataset
    """

    about: Mapping[str, Any]
    description: str
    ended: str
    files: Mapping[str, FileRecord]
    actions: Sequence[Entity]
    others: Sequence[Entity] = ()
    parts: Sequence[str] = ()

    def graph(self) -> Entity:
        """Return the metadata as JSON-LD."""
        profile = {"@id": PROFILE, "@type": "CreativeWork"}
        return {
            # the term is schema.org's; the context of 1.1 was written before it
            "@context": [f"{CRATE}/context", {"sha256": "https://schema.org/sha256"}],
            "@graph": [
                _descriptor(),
                self._root(),
                {**profile, "name": "Process Run Crate", "version": "0.5"},
                self._program(),
                *(_file(name, record) for name, record in self.files.items()),
                {"@id": MANIFEST, "@type": "File", "encodingFormat": "application/json"},
                *self.others,
                *self.actions,
            ],
        }

    def write(self, folder: Path) -> None:
        """Write the metadata into the folder, in one move."""
        text = json.dumps(self.graph(), indent=1, ensure_ascii=False)
        with replace_when_complete(folder / METADATA) as path:
            path.write_text(f"{text}\n", encoding="utf-8")

    def _root(self) -> Entity:
        about = self.about
        return {
            "@id": "./",
            "@type": "Dataset",
            "conformsTo": {"@id": PROFILE},
            "name": about["name"],
            "description": self.description,
            "datePublished": self.ended,
            "license": about.get("licence") or "not stated; the licences of the sources apply",
            **({"creditText": about["attribution"]} if about.get("attribution") else {}),
            "hasPart": references([*map(id_of, self.files), MANIFEST, *self.parts]),
            "mentions": references(action["@id"] for action in self.actions),
        }

    def _program(self) -> Entity:
        versions = self.about["versions"]
        others = [f"{name} {version}" for name, version in versions.items() if name != "uxsim-geo"]
        return {
            "@id": PROGRAM,
            "@type": "SoftwareApplication",
            "name": "uxsim-geo",
            "softwareVersion": versions["uxsim-geo"],
            "softwareRequirements": others,
        }


def action(
    name: str, read: Iterable[str], written: Iterable[str], problems: Sequence[str]
) -> Entity:
    """Describe something that the program did, from the ids of entities to those of others."""
    status = "Failed" if problems else "Completed"
    return {
        "@id": f"#{name}",
        "@type": "CreateAction",
        "name": name,
        "instrument": {"@id": PROGRAM},
        "object": references(dict.fromkeys(read)),
        "result": references(written),
        "actionStatus": {"@id": f"http://schema.org/{status}ActionStatus"},
        **({"error": "; ".join(problems)} if problems else {}),
    }


def source(record: FileRecord) -> Entity:
    """Describe a file that is no part of the crate, by its name and content alone."""
    name = PurePath(record.path).name
    return {"@id": source_id(record), "@type": "CreativeWork", "name": name, **_content(record)}


def source_id(record: FileRecord) -> str:
    """Name such a file."""
    return f"#source-{record.sha256[:16]}-{quote(PurePath(record.path).name)}"


def id_of(name: str) -> str:
    """Name a file or folder of the crate."""
    return quote(name)


def references(ids: Iterable[str]) -> list[Entity]:
    """Refer to entities."""
    return [{"@id": one} for one in ids]


def _descriptor() -> Entity:
    return {
        "@id": METADATA,
        "@type": "CreativeWork",
        "about": {"@id": "./"},
        "conformsTo": {"@id": CRATE},
    }


def _file(name: str, record: FileRecord) -> Entity:
    return {"@id": id_of(name), "@type": "File", "name": name, **_content(record)}


def _content(record: FileRecord) -> Entity:
    kind = TYPES.get(PurePath(record.path).suffix) or mimetypes.guess_type(record.path)[0]
    return {
        "contentSize": str(record.size),
        "encodingFormat": kind or "application/octet-stream",
        "sha256": record.sha256,
    }
