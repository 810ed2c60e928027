"""Files that broke a reader once, and small good ones, at every door: a user's error or none.

``tests/fuzz/fuzz.py`` searches for more.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
from conftest import REPOSITORY

from uxsim_geo.errors import InputError

sys.path.insert(0, str(REPOSITORY / "tests/fuzz"))
import doors

CASES = sorted(path for path in doors.CORPUS.glob("*/*") if path.is_file())


Open = Callable[[str], doors.Opened]


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Open:
    """The door of a name, each opened once."""

    @cache
    def open_once(name: str) -> doors.Opened:
        if name == "omx":
            pytest.importorskip("h5py")
        return doors.Opened(name, tmp_path_factory.mktemp(name))

    return open_once


def read(door: doors.Opened, data: bytes) -> list[str]:
    """The faults that are told; anything else than the user's error ends the test."""
    try:
        door.read(data)
    except InputError as error:
        return [str(fault) for fault in error.faults]
    return []


@pytest.mark.parametrize("case", CASES, ids=lambda path: path.relative_to(doors.CORPUS).as_posix())
@pytest.mark.filterwarnings("ignore")
def test_a_case_is_read_or_refused(case: Path, opened: Open) -> None:
    faults = read(opened(case.parent.name), case.read_bytes())
    assert all(faults)


@pytest.mark.parametrize("name", doors.DOORS)
@pytest.mark.filterwarnings("ignore")
def test_a_door_leads_somewhere(name: str, opened: Open) -> None:
    """The good case is read, but for doors at which a file is read in several ways."""
    door = opened(name)
    faults = read(door, door.good[door.door.main])
    assert not faults or name in doors.READ_IN_SEVERAL_WAYS
