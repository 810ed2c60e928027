"""Full disks, folders that cannot be written to, clocks that jump, networks that are lost.

What a run says then is a line without a traceback; what lies there is whole; and done again in good
circumstances it is what it would have been at once.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import yaml
from loopback import Reply, closed_port
from osm_loopback import Loopback, loopback
from small_run import write_small_run

pytest.importorskip("resource", reason="needs limits and signals of a Unix")

from deaths import End, Moment, Nurse, nursing
from test_killed import MOMENTS, OUTPUTS, contents, distrusted, incomplete

RUN = ("run", "small.yaml", "--out", "runs")


@pytest.fixture(scope="module")
def nurse(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Nurse]:
    with nursing(tmp_path_factory.mktemp("nurse")) as nurse:
        yield nurse


@pytest.fixture
def work(nurse: Nurse) -> Path:
    """The nurse's folder with the files of a run, and nothing else."""
    folder = nurse.folder / "work"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    write_small_run(folder, OUTPUTS)
    return folder


def run(nurse: Nurse, *options: str, prepare: str = "", moment: Moment | None = None) -> End:
    work = nurse.folder / "work"
    paths = [str(work / part) if part in ("small.yaml", "runs") else part for part in RUN]
    return nurse.run([*paths, *options], moment or Moment(), prepare=prepare)


@pytest.fixture(scope="module")
def right(nurse: Nurse) -> dict[str, str]:
    """What an undisturbed run leaves."""
    folder = nurse.folder / "work"
    folder.mkdir(exist_ok=True)
    write_small_run(folder, OUTPUTS)
    end = run(nurse)
    assert end.status == 0, end.said
    return contents(folder)


def told(end: End, *words: str) -> None:
    """See that a command failed, and that it said why, in plain words."""
    assert end.status in (1, 2), end
    assert "Traceback" not in end.said
    assert [word for word in words if word in end.said], end.said


def completes(nurse: Nurse, work: Path, right: dict[str, str]) -> None:
    """See that the run is what it would have been at once."""
    end = run(nurse)
    assert end.status == 0, end.said
    assert contents(work) == right
    assert distrusted(work) == []


@contextmanager
def mounted(folder: Path, *options: str) -> Iterator[None]:
    """Mount something on a folder; the test is skipped where that cannot be."""
    folder.mkdir(exist_ok=True)
    mount = ["mount", *options, str(folder)]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("nothing can be mounted here")
    try:
        yield
    finally:
        subprocess.run(["umount", str(folder)], check=True)


@contextmanager
def read_only(folder: Path) -> Iterator[None]:
    """Let nobody write below a folder; permissions do not keep the superuser from it."""
    if os.geteuid() == 0:
        with mounted(folder, "--bind", str(folder)):
            subprocess.run(["mount", "-o", "remount,ro,bind", str(folder)], check=True)
            yield
        return
    folders = [folder, *(path for path in folder.rglob("*") if path.is_dir())]
    for path in folders:
        path.chmod(0o555)
    try:
        yield
    finally:
        for path in folders:
            path.chmod(0o755)


@pytest.mark.parametrize("size", ["40k", "200k", "600k"])
def test_a_full_disk_spoils_nothing(
    nurse: Nurse, work: Path, right: dict[str, str], size: str
) -> None:
    with mounted(work / "runs", "-t", "tmpfs", "-o", f"size={size}", "tmpfs"):
        told(run(nurse), "No space left on device", "disk is full", "database or disk is full")
        assert incomplete(work, right) == []
        remount = ["mount", "-o", "remount,size=40m", str(work / "runs")]
        subprocess.run(remount, check=True)
        completes(nurse, work, right)


def test_files_that_cannot_grow_spoil_nothing(
    nurse: Nurse, work: Path, right: dict[str, str]
) -> None:
    told(run(nurse, prepare="circumstances:small_files"), "File too large")
    assert incomplete(work, right) == []
    completes(nurse, work, right)


@pytest.mark.parametrize("part", ["runs", "runs/small", "runs/small/network", "runs/small/layers"])
def test_a_folder_that_cannot_be_written_to_is_told(
    nurse: Nurse, work: Path, right: dict[str, str], part: str
) -> None:
    (work / part).mkdir(parents=True)
    with read_only(work / part):
        told(run(nurse), "cannot be written to", "Read-only file system", "Permission denied")
        assert incomplete(work, right) == []
    completes(nurse, work, right)


def test_a_finished_run_that_cannot_be_written_to_stays(
    nurse: Nurse, work: Path, right: dict[str, str]
) -> None:
    assert run(nurse).status == 0
    with read_only(work / "runs"):
        assert run(nurse).status == 0  # there is nothing to do
        told(run(nurse, "--force"), "cannot be written to", "Read-only file system")
        assert contents(work) == right
    completes(nurse, work, right)


def test_a_clock_that_jumps_changes_nothing(
    nurse: Nurse, work: Path, right: dict[str, str]
) -> None:
    end = run(nurse, prepare="circumstances:jumping_clock")
    assert end.status == 0, end.said
    assert contents(work) == right
    assert distrusted(work) == []
    for age, path in enumerate(sorted(work.rglob("*"))):
        # half of all is from before 1970, half from the end of the century
        os.utime(path, (-1e8, -1e8) if age % 2 else (4e9, 4e9))
    again = run(nurse, prepare="circumstances:jumping_clock")
    assert again.status == 0
    assert again.changes == 0  # all is up to date, whatever the times of files are
    assert again.said.count("up to date") == 3
    assert nurse.run(["clean", "--out", str(work / "runs"), "--remove"]).status == 0
    assert contents(work) == right


def test_the_main_job_leaves_the_network_alone(
    nurse: Nurse, work: Path, right: dict[str, str]
) -> None:
    from pyproj.network import is_network_enabled

    end = run(nurse, prepare="circumstances:no_network")
    assert end.status == 0, end.said
    assert contents(work) == right
    assert not is_network_enabled()  # of grids, which Python does not hear of


# ---- downloads --------------------------------------------------------------------------------


@pytest.fixture
def server() -> Iterator[Loopback]:
    with loopback() as state:
        yield state


def write_place(folder: Path, url: str) -> None:
    """A run of the roads of a place, as the server has them."""
    gravity = {
        "zones": {"cell_m": 400},
        "productions": {"road_km": 1},
        "attractions": {"road_km": 1},
        "total_vehicles": 100,
    }
    osm = {"place": "Smalltown", "cache": "cache", "overpass_url": url, "nominatim_url": url}
    told = {
        "name": "small",
        "ingest": {
            "format": "osm",
            "osm": osm | {"timeout_s": 5},
            "demand": [{"gravity": gravity, "demand_period_s": 600}],
        },
        "simulate": {"duration_s": 900},
        "report": {"outputs": [], "plots": []},
    }
    (folder / "small.yaml").write_text(yaml.safe_dump(told), encoding="utf-8")


@pytest.fixture
def downloaded(nurse: Nurse, work: Path, server: Loopback) -> dict[str, str]:
    """What an undisturbed run with its download leaves, at a time that stands still."""
    write_place(work, server.url)
    end = run(nurse, prepare="circumstances:standing_clock")
    assert end.status == 0, end.said
    found = contents(work)
    assert [name for name in found if name.startswith("cache/")]
    forget(work)
    return found


def forget(work: Path) -> None:
    for name in ("cache", "runs"):
        shutil.rmtree(work / name, ignore_errors=True)


def test_a_download_that_is_killed_is_made_again(
    nurse: Nurse, work: Path, downloaded: dict[str, str]
) -> None:
    wrong = []
    # folder, file and record of the download come first
    moments = [*map(Moment, range(1, 1 + MOMENTS)), Moment(size=100)]
    for moment in moments:
        forget(work)
        end = run(nurse, prepare="circumstances:standing_clock", moment=moment)
        assert end.died, (moment, end)
        wrong += [f"{moment}: {name} is not whole" for name in incomplete(work, downloaded)]
        again = run(nurse, prepare="circumstances:standing_clock")
        assert again.status == 0, (moment, again)
        found = contents(work)
        if found != downloaded:
            wrong.append(f"{moment}: {found.items() ^ downloaded.items()}")
    assert wrong == []


@pytest.mark.parametrize("lost", ["cut", "nobody", "stalls"])
def test_a_network_that_is_lost_leaves_nothing(
    nurse: Nurse, work: Path, server: Loopback, downloaded: dict[str, str], lost: str
) -> None:
    begun = b'{"elements": ['
    reply, edit = {
        "cut": (Reply(body=begun, cut=True), "ingest.osm.timeout_s=5"),
        "stalls": (Reply(body=begun, stalls=True), "ingest.osm.timeout_s=1"),
        "nobody": (None, f"ingest.osm.overpass_url={closed_port()}"),
    }[lost]
    server.replies["/interpreter"] = [] if reply is None else [reply]
    end = run(nurse, "--set", edit, prepare="circumstances:standing_clock")
    told(end, "cut off", "cannot be reached", "no answer within")
    assert not (work / "runs").exists()
    assert [path for path in (work / "cache").rglob("*") if path.is_file()] == []
    again = run(nurse, prepare="circumstances:standing_clock")
    assert again.status == 0, again.said
    assert contents(work) == downloaded
