"""Runs and studies that are killed: what is there is whole, and done again it is the same.

Every death is real: a process ends without tidying up, before a change of its folder or in the
middle of a file (see deaths.py). A few moments of every stage are tried here; as many as
UXSIM_GEO_DEATHS says, in place of that.
"""

from __future__ import annotations

import hashlib
import json
import os
import random
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest
from small_run import CONFIG, write_small_run
from study_files import STUDY, write_study

pytest.importorskip("resource", reason="needs limits and signals of a Unix")

from deaths import NEVER, Moment, Nurse, nursing

from pipeline.verification import verify_run

MOMENTS = int(os.environ.get("UXSIM_GEO_DEATHS", "4"))

#: outputs of every kind that takes a moment to write
OUTPUTS = CONFIG.replace(
    "outputs: [geopackage]\n  plots: []",
    "outputs: [geopackage, page, geoparquet, flatgeobuf]\n  layers: [od_lines]\n"
    "  plots:\n    - plot: travel_times",
)

#: a study of two scenarios, compared
COMPARED = STUDY.replace("seeds: 3", "seeds: 2").replace("comparison: none", "comparison: tables")

#: what holds the time of day
TOLD = ("manifest.json", "ro-crate-metadata.json", "record.json")
#: what grows: of a call that was killed it may lack the last lines
LOGS = ("run.log", "study.log")


@dataclass(frozen=True)
class Case:
    """A command that is killed in a folder.

    before
        commands that were done there before, undisturbed; with other settings
    command, *options
        the one that is killed, and then done again
    """

    name: str
    command: Sequence[str]
    before: Sequence[Sequence[str]] = ()


RUN = ("run", "small.yaml", "--out", "runs")
OTHER = ("--set", "simulate.seed=3", "--set", "report.plots=[]")
CASES = (
    Case("ingest", ("ingest", *RUN[1:])),
    Case("simulate", ("simulate", *RUN[1:]), [("ingest", *RUN[1:])]),
    Case("report", RUN, [("simulate", *RUN[1:])]),
    Case("all over an earlier run", (*RUN, *OTHER), [RUN]),
    Case("study", ("study", "study.yaml", "--out", "runs", "--scheduler", "none")),
)


@pytest.fixture(scope="module")
def nurse(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Nurse]:
    with nursing(tmp_path_factory.mktemp("nurse")) as nurse:
        yield nurse


def fresh(folder: Path) -> None:
    """Lay out the files of a run and of a study."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    write_study(folder, COMPARED)
    write_small_run(folder, OUTPUTS.replace("duration_s: 1200", "duration_s: 900"))


def at(folder: Path, command: Sequence[str]) -> list[str]:
    """The command with its paths in a folder."""
    inside = ("small.yaml", "study.yaml", "runs")
    return [str(folder / part) if part in inside else part for part in command]


def contents(folder: Path) -> dict[str, str]:
    """What all files below hold, hidden ones too; of those with the time of day that they are."""
    files = [path for path in sorted(folder.rglob("*")) if path.is_file()]
    return {
        path.relative_to(folder).as_posix(): digest(path) for path in files if path.name not in LOGS
    }


def digest(path: Path) -> str:
    """SHA-256 of a file; of JSON with times only whether it is whole."""
    data = path.read_bytes()
    if path.name in TOLD:
        json.loads(data)
        return "whole"
    if path.name == "summary.json":
        data = json.dumps(json.loads(data) | {"engine_wall_s": 0}).encode()
    return hashlib.sha256(data).hexdigest()


def is_unfinished(path: Path, folder: Path) -> bool:
    """Tell whether a file has no final name yet, and thus may be half of one."""
    parts = path.relative_to(folder).parts
    return any(part.startswith(".") for part in parts) or "unfinished" in parts


def incomplete(folder: Path, *whole: dict[str, str]) -> list[str]:
    """Files under a final name that are neither what an undisturbed run leaves nor what was."""
    found = []
    for path in sorted(folder.rglob("*")):
        if not path.is_file() or is_unfinished(path, folder) or path.name in LOGS:
            continue
        name = path.relative_to(folder).as_posix()
        if not any(one.get(name) == digest(path) for one in whole):
            found.append(name)
    return found


def moments(changes: int, sizes: Sequence[int], seed: int) -> list[Moment]:
    """Moments between the changes and in the middle of files, as many as there are to be."""
    drawn = random.Random(seed)
    within = max(MOMENTS // 3, 1)
    before = min(MOMENTS - within, changes)
    among = [Moment(change) for change in sorted(drawn.sample(range(1, changes + 1), before))]
    return among + [
        Moment(size=max(int(drawn.choice(sizes) * drawn.random()), 1)) for _ in range(within)
    ]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_killed_and_done_again_is_as_if_nothing_had_been(nurse: Nurse, case: Case) -> None:
    work = nurse.folder / "work"
    fresh(work)
    for command in case.before:
        assert nurse.run(at(work, command)).status == 0
    start = nurse.folder / "start"
    shutil.rmtree(start, ignore_errors=True)
    shutil.copytree(work, start)
    before = contents(work)
    undisturbed = nurse.run(at(work, case.command))
    assert undisturbed.status == 0, undisturbed.said
    right = contents(work)
    sizes = [path.stat().st_size for path in work.rglob("*") if path.is_file()]
    wrong = []
    for moment in moments(undisturbed.changes, sizes, len(case.name)):
        shutil.rmtree(work)
        shutil.copytree(start, work)
        end = nurse.run(at(work, case.command), moment)
        if moment.change:
            assert end.died, (moment, end)
        wrong += [f"{moment}: {name} is not whole" for name in incomplete(work, before, right)]
        again = nurse.run(at(work, case.command), NEVER)
        wrong += differences(moment, contents(work), right)
        if again.status != 0:
            wrong.append(f"{moment}: {again.said}")
        wrong += [f"{moment}: {line}" for line in distrusted(work)]
    assert wrong == []


def differences(moment: Moment, found: dict[str, str], right: dict[str, str]) -> list[str]:
    """What differs from an undisturbed run: content, files that lack, files too many."""
    names = sorted(found.keys() | right.keys())
    return [
        f"{moment}: {name}: {found.get(name, 'absent')[:8]}, not {right.get(name, 'absent')[:8]}"
        for name in names
        if found.get(name) != right.get(name)
    ]


def distrusted(work: Path) -> list[str]:
    """What the runs' own verification finds."""
    found = []
    for manifest in sorted(work.glob("runs/**/manifest.json")):
        if (manifest.parent / "run.log").is_file():
            verified = verify_run(manifest.parent)
            found += [*verified.wrong, *verified.remarks]
    return found
