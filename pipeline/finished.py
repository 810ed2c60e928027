"""Finished runs read back: only where their files are those that the manifest vouches for."""

from __future__ import annotations

from pipeline.material import Material
from pipeline.runs import Manifest, RunFolder, StageRecord, is_unchanged
from uxsim_geo.errors import Fault, Faults, InputError


def check_run(folder: RunFolder, manifest: Manifest, faults: Faults) -> None:
    """See that the run has been simulated, and that its tables come from just those files."""
    own = Faults(str(folder.path))
    stages = manifest.stages
    if not stages:
        own.add("is no run: it holds no readable manifest.json; name one, as runs/sioux_falls")
    elif not {"ingest", "simulate"} <= stages.keys():
        own.add("has not been simulated: uxsim-geo simulate with its configuration does that")
    else:
        for problem in (*stages["ingest"].problems, *stages["simulate"].problems):
            own.add(problem)
        _check_files(folder, stages, own)
    faults.extend(own)


def _check_files(folder: RunFolder, stages: dict[str, StageRecord], faults: Faults) -> None:
    """Compare the tables of ingestion, as the simulation read them, and what it wrote."""
    from pipeline.simulate import tables_of

    records = stages["ingest"].outputs | stages["simulate"].outputs
    read = stages["simulate"].inputs.values()
    records |= {record.path: record for record in read if record.path in records}
    for name in sorted({*records, *tables_of(folder)}):
        if name not in records or not is_unchanged(records[name], folder / name):
            wrong = "is not what the run wrote" if (folder / name).exists() else "is missing"
            faults.add(f"{name} {wrong}; run it again")


def read_run(folder: RunFolder, manifest: Manifest) -> Material:
    """Read the tables of a run that has been checked.

    Raises :class:`uxsim_geo.errors.InputError` for a configuration of another version, and for
    files that are damaged.
    """
    from pydantic import ValidationError

    from pipeline.config import Config
    from pipeline.material import read_material
    from pipeline.progress import Silence
    from pipeline.stages import Task

    try:
        # not from config.yaml, whose source files may be elsewhere by now
        config = Config.model_validate(manifest.run["config"])
    except (KeyError, ValidationError):
        what = "was made by another version of uxsim-geo, or its manifest is damaged; run it again"
        raise InputError([Fault(what, str(folder.path))]) from None
    figures = {name: stage.figures for name, stage in manifest.stages.items()}
    task = Task(config, folder, figures, Silence(), lambda: None)
    return read_material(task)
