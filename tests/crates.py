"""RO-Crates as their readers take them: entities by id, and no reference that leads nowhere."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pipeline.ro_crate import METADATA


def entities_of(folder: Path) -> dict[str, Any]:
    """The entities of the crate in a folder; every reference leads to one of them, or the web."""
    crate = json.loads((folder / METADATA).read_text())
    entities = {entity["@id"]: entity for entity in crate["@graph"]}
    assert len(entities) == len(crate["@graph"])
    for entity in crate["@graph"]:
        for value in entity.values():
            for one in value if isinstance(value, list) else [value]:
                if isinstance(one, dict) and not one["@id"].startswith("http"):
                    assert one["@id"] in entities
    return entities
