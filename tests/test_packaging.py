"""What a user installs: wheel and sdist, and the main job by them, outside of the repository.

The wheel is built from the sdist, so that both are looked at. It is installed into an environment
of its own that sees the libraries of this one, and nothing of the repository.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import venv
import zipfile
from collections.abc import Sequence
from email.message import Message
from email.parser import Parser
from pathlib import Path, PurePosixPath

import pytest
from conftest import REPOSITORY

from pipeline.runs import sha256_of
from uxsim_geo.version import __version__

NAME = f"uxsim_geo-{__version__}"
PACKAGES = ("pipeline", "uxsim_geo")
#: what is left where a tree has been worked in
LEFT_OVER = ("__pycache__", ".mypy_cache", ".ruff_cache", ".pytest_cache", ".hypothesis", "runs")


#: what a problem says where pictures in space and time cannot be drawn
NO_OPENGL = "no OpenGL"


def run_in(folder: Path, command: Sequence[str | Path], forgiven: str | None = None) -> str:
    """Run a command in a folder, without the paths of this process; give what it printed.

    It must succeed, unless it says what is forgiven.
    """
    own = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    done = subprocess.run(
        [str(part) for part in command],
        cwd=folder,
        env=own,
        capture_output=True,
        text=True,
        check=False,
    )
    said = done.stdout + done.stderr
    assert done.returncode == 0 or (forgiven is not None and forgiven in said), said
    return done.stdout


@pytest.fixture(scope="module")
def sdist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The sdist of this tree, as a file."""
    pytest.importorskip("hatchling")
    folder = tmp_path_factory.mktemp("sdist")
    run_in(REPOSITORY, [sys.executable, "-m", "hatchling", "build", "-t", "sdist", "-d", folder])
    return folder / f"{NAME}.tar.gz"


@pytest.fixture(scope="module")
def unpacked(sdist: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("unpacked")
    with tarfile.open(sdist) as archive:
        archive.extractall(folder, filter="data")
    return folder / NAME


@pytest.fixture(scope="module")
def wheel(unpacked: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel made of the sdist."""
    folder = tmp_path_factory.mktemp("wheel")
    run_in(unpacked, [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder])
    return folder / f"{NAME}-py3-none-any.whl"


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of programs of an environment into which the wheel has been installed."""
    folder = tmp_path_factory.mktemp("environment")
    venv.create(folder, symlinks=True)
    programs = folder / "bin"
    python = programs / "python"
    code = "import sysconfig; print(sysconfig.get_path('purelib'))"
    site = Path(run_in(folder, [python, "-c", code]).strip())
    # as a line of a .pth file, so that .pth files there, as of an editable install, do not count
    libraries = {sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}
    (site / "libraries.pth").write_text("\n".join(sorted(libraries)) + "\n", encoding="utf-8")
    pip = [sys.executable, "-m", "pip", "--quiet", "--python", python, "install"]
    run_in(folder, [*pip, "--no-deps", "--no-index", "--ignore-installed", wheel])
    return programs


@pytest.fixture(scope="module")
def workplace(installed: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of a user with the examples and a finished main job; warnings were errors."""
    folder = tmp_path_factory.mktemp("workplace")
    said = run_in(folder, [installed / "uxsim-geo", "examples"])
    main_job = next(line for line in said.splitlines() if "/sioux_falls.yaml" in line)
    name, *rest = main_job.split()
    assert name == "uxsim-geo"
    warnings = os.environ.get("UXSIM_GEO_WARNINGS", "error")
    strictly = [installed / "python", "-W", warnings, "-m", "pipeline"]
    run_in(folder, [*strictly, *rest, "--quiet"], forgiven=NO_OPENGL)
    return folder


def names_in(wheel: Path) -> set[str]:
    with zipfile.ZipFile(wheel) as archive:
        return set(archive.namelist())


def sources(*parts: str) -> set[str]:
    """The files of parts of the repository, without what work leaves behind."""
    files = (path for part in parts for path in (REPOSITORY / part).rglob("*") if path.is_file())
    names = {path.relative_to(REPOSITORY) for path in files}
    return {name.as_posix() for name in names if not set(name.parts) & set(LEFT_OVER)}


def test_the_wheel_has_the_packages_and_the_examples_and_nothing_else(wheel: Path) -> None:
    examples = {f"pipeline/examples/{name}" for name in sources("configs", "data")}
    names = {name for name in names_in(wheel) if ".dist-info/" not in name}
    assert names == sources(*PACKAGES) | examples
    assert {f"{package}/py.typed" for package in PACKAGES} <= names


def test_the_sdist_has_what_it_takes_to_work_on(unpacked: Path) -> None:
    files = (path.relative_to(unpacked) for path in unpacked.rglob("*") if path.is_file())
    names = {path.as_posix() for path in files}
    parts = (*PACKAGES, "configs", "data", "docs", "tests", "benchmarks")
    assert sources(*parts) <= names
    assert {"LICENSE", "README.md", "CHANGELOG.md", "CONTRIBUTING.md", "Makefile"} <= names
    assert {"requirements.lock", "requirements-test.lock", "requirements-minimum.lock"} <= names
    assert not any(set(PurePosixPath(name).parts) & set(LEFT_OVER) for name in names)


def metadata_of(wheel: Path) -> Message:
    with zipfile.ZipFile(wheel) as archive:
        return Parser().parsestr(archive.read(f"{NAME}.dist-info/METADATA").decode("utf-8"))


def test_the_metadata_say_what_this_is(wheel: Path) -> None:
    told = metadata_of(wheel)
    assert told["Name"] == "uxsim-geo"
    assert told["Version"] == __version__
    assert told["License-Expression"] == "MIT"
    assert told["Requires-Python"] == "<3.14,>=3.11"
    assert told["Description-Content-Type"] == "text/markdown"
    assert str(told.get_payload()).strip() == (REPOSITORY / "README.md").read_text("utf-8").strip()
    classifiers = told.get_all("Classifier", [])
    for minor in (11, 12, 13):
        assert f"Programming Language :: Python :: 3.{minor}" in classifiers
    assert set(told.get_all("Provides-Extra", [])) == {"dask", "docs", "omx", "test", "video"}


def test_the_program_says_its_version(installed: Path, tmp_path: Path) -> None:
    assert run_in(tmp_path, [installed / "uxsim-geo", "--version"]) == f"uxsim-geo {__version__}\n"


def test_it_is_the_wheel_that_runs(installed: Path, tmp_path: Path) -> None:
    code = "import pipeline, uxsim_geo; print(pipeline.__file__, uxsim_geo.__file__)"
    for path in run_in(tmp_path, [installed / "python", "-c", code]).split():
        assert Path(path).is_relative_to(installed.parent)


def test_the_main_job_runs_by_the_wheel_alone(workplace: Path) -> None:
    run = workplace / "runs/sioux_falls"
    manifest = json.loads((run / "manifest.json").read_text("utf-8"))
    assert manifest["stages"].keys() == {"ingest", "simulate", "report"}
    for stage in manifest["stages"].values():
        assert [problem for problem in stage["problems"] if NO_OPENGL not in problem] == []
        for name, file in stage["outputs"].items():
            assert sha256_of(run / name) == file["sha256"]
    assert {"results.gpkg", "report.html"} <= manifest["stages"]["report"]["outputs"].keys()


def test_the_examples_are_those_of_the_repository(workplace: Path) -> None:
    copies = workplace / "uxsim-geo-examples"
    for name in sources("configs", "data"):
        assert (copies / name).read_bytes() == (REPOSITORY / name).read_bytes()


PROGRAM = """
from uxsim_geo import Demand, Network, Result, Settings, World, simulate
from pipeline.config import Config


def delays(network: Network, demand: Demand) -> list[float]:
    result: Result = simulate(network, demand, Settings(duration=600.0))
    done = result.trips[result.trips["status"] == "completed"]
    return [float(value) for value in done["arrive_s"] - done["enter_s"] - done["free_time_s"]]


def name_of(config: Config) -> str:
    return config.name


world = World(tmax=1200, random_seed=0)
world.addNode("a", 0, 0)
world.addNode("b", 1, 0)
world.addLink("ab", "a", "b", length=1000, free_flow_speed=20, number_of_lanes=2)
world.adddemand("a", "b", 0, 900, 0.8)
world.exec_simulation()
world.analyzer.print_simple_stats()
"""


def test_a_users_program_is_checked_by_the_types_of_the_wheel(
    installed: Path, tmp_path: Path
) -> None:
    pytest.importorskip("mypy")
    (tmp_path / "program.py").write_text(PROGRAM, encoding="utf-8")
    (tmp_path / "wrong.py").write_text(PROGRAM.replace("600.0", '"600"'), encoding="utf-8")
    mypy = shutil.which("mypy", path=str(Path(sys.executable).parent)) or "mypy"
    strict = [mypy, "--strict", "--python-executable", installed / "python", "--cache-dir", "cache"]
    assert "Success" in run_in(tmp_path, [*strict, "program.py"])
    with pytest.raises(AssertionError, match="arg-type"):
        run_in(tmp_path, [*strict, "wrong.py"])
