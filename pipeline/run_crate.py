"""A run as an RO-Crate: its files, and its stages as actions."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime, timedelta

from pipeline.ro_crate import Crate, Entity, action, id_of, source, source_id
from pipeline.runs import CONFIG, FileRecord, Manifest, RunFolder, StageRecord


def write_crate(folder: RunFolder, manifest: Manifest) -> None:
    """Describe a run in its folder; all times are those of the manifest."""
    files = _files(manifest)
    actions = [_action(name, stage, files) for name, stage in manifest.stages.items()]
    read = {source_id(r): r for s in manifest.stages.values() for r in _foreign(s, files)}
    name = manifest.run["name"]
    Crate(
        about=manifest.run,
        description=f"Traffic simulation {name}: settings, tables and results.",
        ended=max(one.get("endTime", "") for one in actions),
        files=files,
        actions=actions,
        others=[source(record) for _, record in sorted(read.items())],
    ).write(folder.path)


def _action(name: str, stage: StageRecord, files: dict[str, FileRecord]) -> Entity:
    read = [id_of(record.path) for record in stage.inputs.values() if record.path in files]
    read += [source_id(record) for record in _foreign(stage, files)]
    made = action(name, read, map(id_of, stage.outputs), stage.problems)
    return {**made, **_times(stage)}


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
