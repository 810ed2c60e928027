"""Compiled code on disk: found again, never a reason to fail, and told when it must be made."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import REPOSITORY

#: a module with one compiled function; what it prints: its result, and whether the code was found
MODULE = """\
from pathlib import Path
from uxsim_geo.compiling import digest_of_sources, entry

@entry(digest_of_sources(Path(__file__)), "the test", nogil=True)
def times(number):
    return FACTOR * number

print(times(21), sum(times.stats.cache_hits.values()))
"""
FIRST = "compiling the test, once for this version: about 15 s"


class Program:
    """The module as a program of its own, with its cache."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / "program.py"
        self.cache = folder / "cache"
        self.write(2)

    def write(self, factor: int) -> None:
        self.path.write_text(MODULE.replace("FACTOR", str(factor)), encoding="utf-8")

    def start(self, **variables: str) -> subprocess.Popen[str]:
        ours = {"UXSIM_GEO_CACHE": str(self.cache), "PYTHONPATH": str(REPOSITORY)}
        others = {name: text for name, text in os.environ.items() if not name.startswith("NUMBA_")}
        pipe = subprocess.PIPE
        command = [sys.executable, str(self.path)]
        environment = others | ours | variables
        return subprocess.Popen(command, env=environment, stdout=pipe, stderr=pipe, text=True)

    def run(self, **variables: str) -> tuple[str, str]:
        """Give what it prints, and what it says to the user."""
        return told(self.start(**variables))

    def files(self) -> list[Path]:
        return sorted((self.cache / "compiled").iterdir())


def told(process: subprocess.Popen[str]) -> tuple[str, str]:
    out, err = process.communicate()
    assert process.returncode == 0, err
    return out.strip(), err.strip()


@pytest.fixture
def program(tmp_path: Path) -> Program:
    return Program(tmp_path)


def test_it_is_told_once_that_code_is_compiled(program: Program) -> None:
    assert program.run() == ("42 0", FIRST)
    assert program.run() == ("42 1", "")


def test_numbas_variable_names_another_folder(program: Program, tmp_path: Path) -> None:
    variables = {"NUMBA_CACHE_DIR": str(tmp_path / "numba")}
    assert [program.run(**variables)[0] for _ in range(2)] == ["42 0", "42 1"]
    assert len(list((tmp_path / "numba" / "uxsim-geo").iterdir())) == 1
    assert not program.cache.exists()


def test_processes_that_begin_at_once_leave_one_piece_of_code(program: Program) -> None:
    processes = [program.start() for _ in range(3)]
    assert {told(process)[0].split()[0] for process in processes} == {"42"}
    assert [path.suffix for path in program.files()] == [".code"]
    assert program.run() == ("42 1", "")


@pytest.mark.parametrize("damage", ["empty", "cut", "changed", "longer", "not ours"])
def test_damaged_code_is_compiled_anew(program: Program, damage: str) -> None:
    program.run()
    [path] = program.files()
    whole = path.read_bytes()
    middle = len(whole) // 2
    flipped = bytes([whole[middle] ^ 1])
    path.write_bytes(
        {
            "empty": b"",
            "cut": whole[:middle],
            "changed": whole[:middle] + flipped + whole[middle + 1 :],
            "longer": whole + b"\0",
            "not ours": b"\x80\x05N.",
        }[damage]
    )
    assert program.run() == ("42 0", FIRST)
    assert program.run() == ("42 1", "")


def test_code_of_other_sources_is_left_for_those_who_use_it(program: Program) -> None:
    program.run()
    program.write(3)
    assert program.run() == ("63 0", FIRST)
    program.write(2)
    assert program.run() == ("42 1", "")


def test_code_under_other_flags_of_numba_is_other_code(program: Program) -> None:
    program.run()
    assert program.run(NUMBA_BOUNDSCHECK="1")[0] == "42 0"
    assert program.run()[0] == "42 1"


def test_where_no_folder_can_be_made_it_is_said_and_compiled(program: Program) -> None:
    program.cache.write_text("a file where the folder should be", encoding="utf-8")
    for _ in range(2):
        out, err = program.run()
        assert out == "42 0"
        assert err.startswith("compiling the test, in every process, since it cannot be kept in ")
        assert str(program.cache / "compiled") in err


@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() == 0, reason="nothing is read-only to this user"
)
def test_a_folder_that_is_read_only_is_read(program: Program) -> None:
    program.run()
    folder = program.cache / "compiled"
    folder.chmod(0o500)
    try:
        assert program.run() == ("42 1", "")
        program.write(3)
        out, err = program.run()
    finally:
        folder.chmod(0o700)
    assert out == "63 0"
    assert "cannot be kept" in err
    assert len(program.files()) == 1


@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() != 0, reason="files can be given away by root alone"
)
def test_code_of_another_user_is_not_run(program: Program) -> None:
    program.run()
    [path] = program.files()
    os.chown(path, 12345, -1)
    assert program.run() == ("42 0", FIRST)
    assert path.stat().st_uid == 0


@pytest.mark.skipif(os.name != "posix", reason="permissions of POSIX")
def test_code_that_others_can_write_to_is_not_run(program: Program) -> None:
    program.run()
    [path] = program.files()
    path.chmod(0o620)
    assert program.run() == ("42 0", FIRST)
    assert program.run() == ("42 1", "")


def test_the_code_that_was_used_last_stays(program: Program) -> None:
    program.run()
    [used] = program.files()
    for age in range(150):
        path = used.with_name(f"older-{age:03}.code")
        path.write_bytes(b"")
        os.utime(path, (1e9 - age, 1e9 - age))
    os.utime(used, (1e9 - 1000, 1e9 - 1000))
    assert program.run()[0] == "42 1"  # which is its use
    program.write(3)
    program.run()
    files = program.files()
    assert len(files) == 100
    assert used in files
    assert "older-097.code" in {path.name for path in files}
    assert "older-098.code" not in {path.name for path in files}
