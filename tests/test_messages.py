"""What a user is told of slips in files, word by word: ``tests/listings/messages.txt``.

After a change of words on purpose: ``python tests/test_messages.py`` writes the listing anew; read
what has changed in it. Each message says what is wrong, where it stands and what to do about it.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from contextlib import chdir
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(REPOSITORY / part) for part in ("tests/fuzz", "tests", ".")]

import doors  # noqa: E402
import pytest  # noqa: E402
import yaml  # noqa: E402
from message_sites import reached_sites, recording, sites  # noqa: E402

from uxsim_geo.errors import InputError  # noqa: E402

LISTING = REPOSITORY / "tests/listings/messages.txt"

#: a file, a piece of its text, and what stands there instead
Change = tuple[str, str, str]

#: slips by door and what is wrong
CASES: dict[str, dict[str, list[Change]]] = yaml.safe_load(
    LISTING.with_name("message_cases.yaml").read_text(encoding="utf-8")
)

#: places in the program that word an error which the listing does not show; may only go down
NOT_SHOWN = 663


def case_of(door: doors.Opened, changes: list[Change]) -> bytes:
    """The good files of a door with some changes, as a case."""
    parts = dict(door.good)
    for name, old, new in changes:
        text = parts[name].decode()
        assert old in text, f"{name} has no {old}"
        changed = text.replace(old, new, 1) if old else f"{new}\n" if new else ""
        parts[name] = changed.encode()
    if len(parts) == 1:
        return parts[door.door.main]
    return b"".join(b"=== %s\n%s" % (name.encode(), text) for name, text in parts.items())


def told(door: doors.Opened, changes: list[Change]) -> Iterator[str]:
    """What is said of the files with some changes."""
    try:
        door.read(case_of(door, changes))
    except InputError as error:
        for fault in error.faults:
            text = str(fault).replace(f"{door.folder.resolve()}/", "")
            yield text.replace(f"{door.folder}/", "")
    else:
        yield "(nothing is told)"


def listing() -> str:
    """All messages, under what is wrong; the files are made in folders of the current one.

    Their paths are short, for long values are cut in messages.
    """
    lines = [
        "What is told of slips in files, as message_cases.yaml makes them;",
        "written by: python tests/test_messages.py",
    ]
    for name, cases in CASES.items():
        Path(name).mkdir()
        door = doors.Opened(name, Path(name))
        lines += ["", f"# {name}"]
        for what, changes in cases.items():
            lines += ["", what, *(f"    {line}" for line in told(door, changes))]
    return "\n".join([*lines, ""])


def test_messages_are_those_of_the_listing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with recording() as reached:
        found = listing()
    assert found == LISTING.read_text(encoding="utf-8")
    shown = reached_sites(reached)
    # a new error is shown here too, or is counted with those that are not
    assert len(sites()) - len(shown) <= NOT_SHOWN


def write() -> None:
    """Write the listing anew, and say what it does not show."""
    with tempfile.TemporaryDirectory() as folder, chdir(folder), recording() as reached:
        LISTING.write_text(listing(), encoding="utf-8")
    shown = reached_sites(reached)
    every = sites()
    for name, line in sorted(every.keys() - shown):
        sys.stdout.write(f"{name}:{line}\n")
    sys.stdout.write(f"{len(shown)} of {len(every)} places shown, {len(every) - len(shown)} not\n")


if __name__ == "__main__":
    write()
