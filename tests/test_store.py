"""The store of what stages have made: whole entries alone, checked, whoever else works on it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from conftest import REPOSITORY
from small_run import NET, write_small_run

from pipeline import ingest, simulate
from pipeline.config_file import load_config
from pipeline.execution import Run
from pipeline.progress import Silence
from pipeline.runs import RunFolder, StageRecord
from pipeline.stages import Outcome, Task
from pipeline.store import Entry, Store, key_of, place

KEY = "ab" + 62 * "0"


class Listener(Silence):
    """Remembers what was said."""

    def __init__(self) -> None:
        self.text = ""

    def say(self, text: str) -> None:
        self.text += text + "\n"


def kept(store: Store, folder: RunFolder, text: str = "one") -> Entry:
    """An entry of two files, kept under the key."""
    (folder / "sub").mkdir(parents=True, exist_ok=True)
    for name in ("a.txt", "sub/b.txt"):
        (folder / name).write_text(text, encoding="utf-8")
    record = StageRecord(outputs=folder.output_records(["a.txt", "sub/b.txt"]))
    entry = Entry(record, "two files", ("warning: of a test",))
    store.keep(KEY, entry, folder)
    return entry


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store(tmp_path / "store")


@pytest.fixture
def folder(tmp_path: Path) -> RunFolder:
    return RunFolder(tmp_path / "run")


def test_what_was_kept_is_found_and_handed_out(
    store: Store, folder: RunFolder, tmp_path: Path
) -> None:
    entry = kept(store, folder)
    found = store.find(KEY)
    assert (found.entry, found.remark) == (entry, "")
    other = RunFolder(tmp_path / "other")
    assert store.hand_out(KEY, entry, other)
    assert (other / "sub/b.txt").read_text() == "one"
    assert [path.name for path in store.entries()] == [KEY]
    assert store.find(KEY[::-1]).entry is None


def test_files_are_copied_where_they_cannot_be_linked(
    store: Store, folder: RunFolder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_links(*_: object) -> None:
        raise PermissionError

    monkeypatch.setattr(os, "link", no_links)
    entry = kept(store, folder)
    other = RunFolder(tmp_path / "other")
    assert store.hand_out(KEY, entry, other)
    assert (other / "a.txt").read_text() == "one"
    assert not (other / "a.txt").samefile(folder / "a.txt")


def test_a_file_is_placed_over_itself_and_over_others(tmp_path: Path) -> None:
    one, other = tmp_path / "one", tmp_path / "other"
    one.write_text("1")
    other.write_text("2")
    for _ in range(2):
        place(one, other)
        assert other.read_text() == "1"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one", "other"]


def flip(folder: Path) -> None:
    data = bytearray((folder / "sub/b.txt").read_bytes())
    data[0] ^= 1
    (folder / "sub/b.txt").write_bytes(data)


def cut(folder: Path) -> None:
    (folder / "a.txt").write_bytes(b"")


def lose(folder: Path) -> None:
    (folder / "a.txt").unlink()


def damage_record(folder: Path) -> None:
    text = (folder / "record.json").read_text()
    (folder / "record.json").write_text(text[: len(text) // 2])


def outside(folder: Path) -> None:
    data = json.loads((folder / "record.json").read_text())
    data["record"]["outputs"]["../../a.txt"] = data["record"]["outputs"].pop("a.txt")
    (folder / "record.json").write_text(json.dumps(data))


@pytest.mark.parametrize("damage", [flip, cut, lose, damage_record, outside])
def test_a_damaged_entry_is_thrown_away_and_told(
    store: Store, folder: RunFolder, damage: object
) -> None:
    kept(store, folder)
    assert callable(damage)
    damage(store.folder_of(KEY))
    found = store.find(KEY)
    assert found.entry is None
    assert "damaged" in found.remark
    assert not store.folder_of(KEY).exists()
    assert list((store.path / "unfinished").iterdir()) == []
    assert store.find(KEY).remark == ""


def test_the_first_to_keep_an_entry_keeps_it(store: Store, folder: RunFolder) -> None:
    first = kept(store, folder)
    kept(store, RunFolder(folder.path / "another"), "two")
    assert store.find(KEY).entry == first


def test_a_file_changed_in_its_place_in_a_run_is_no_longer_handed_out(
    store: Store, folder: RunFolder
) -> None:
    kept(store, folder)
    (folder / "a.txt").write_text("changed, and the store's too where they are one file")
    found = store.find(KEY)
    assert found.entry is None or store.folder_of(KEY).joinpath("a.txt").read_text() == "one"


def test_half_an_entry_leaves_nothing(store: Store, folder: RunFolder) -> None:
    entry = kept(store, folder)
    (folder / "sub/b.txt").unlink()
    other = KEY.replace("ab", "cd")
    with pytest.raises(FileNotFoundError):
        store.keep(other, entry, folder)
    assert not store.folder_of(other).exists()
    assert list((store.path / "unfinished").iterdir()) == []


def test_an_entry_that_goes_while_it_is_handed_out(
    store: Store, folder: RunFolder, tmp_path: Path
) -> None:
    entry = kept(store, folder)
    assert store.discard(store.folder_of(KEY))
    assert not store.discard(store.folder_of(KEY))
    assert not store.hand_out(KEY, entry, RunFolder(tmp_path / "other"))


MANY = """
import sys
from pathlib import Path
sys.path.insert(0, "tests")
from test_store import kept_by
kept_by(Path(sys.argv[1]), sys.argv[2])
"""


def kept_by(path: Path, name: str) -> None:
    """Keep, read and discard many entries, when told to begin."""
    store, folder = Store(path / "store"), RunFolder(path / name)
    (folder / "sub").mkdir(parents=True)
    for file in ("a.txt", "sub/b.txt"):
        (folder / file).write_text("the same", encoding="utf-8")
    record = StageRecord(outputs=folder.output_records(["a.txt", "sub/b.txt"]))
    entry = Entry(record, "", ())
    print("ready", flush=True)  # noqa: T201
    sys.stdin.readline()
    for number in range(300):
        key = f"{number % 20:064x}"
        store.keep(key, entry, folder)
        found = store.find(key)
        assert found.remark == ""
        if found.entry is not None:
            assert found.entry == entry
            store.hand_out(key, found.entry, RunFolder(path / f"{name}_{number}"))
        if number % 7 == 0:
            store.discard(store.folder_of(key))


def test_several_processes_on_one_store_see_whole_entries_alone(tmp_path: Path) -> None:
    command = [sys.executable, "-c", MANY, str(tmp_path)]
    processes = [
        subprocess.Popen(
            [*command, name],
            cwd=REPOSITORY,
            text=True,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
        for name in ("x", "y", "z")
    ]
    for process in processes:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
    for process in processes:
        assert process.stdin is not None
        process.stdin.write("\n")
        process.stdin.flush()
    for process in processes:
        _, said = process.communicate()
        assert process.returncode == 0, said
    store = Store(tmp_path / "store")
    for path in store.entries():
        assert store.find(path.name).entry is not None
    assert list((store.path / "unfinished").iterdir()) == []


def test_keys_are_of_the_content_and_not_of_the_place(folder: RunFolder) -> None:
    kept_files = RunFolder(folder.path)
    kept(Store(folder.path / "store"), kept_files)
    inputs = kept_files.output_records(["a.txt"])
    elsewhere = {name: replace(record, path="/else/where") for name, record in inputs.items()}
    key = key_of("simulate", {"seed": 1}, inputs)
    assert key_of("simulate", {"seed": 1}, elsewhere) == key
    changed = {name: replace(record, sha256=64 * "0") for name, record in inputs.items()}
    others = (
        key_of("measure", {"seed": 1}, inputs),
        key_of("simulate", {"seed": 2}, inputs),
        key_of("simulate", {"seed": 1}, changed),
        key_of("simulate", {"seed": 1}, {"b.txt": inputs["a.txt"]}),
    )
    assert len({key, *others}) == 5


STAGES = (ingest.STAGE, simulate.STAGE)


def run(folder: Path, name: str, *edits: str, store: Store | None = None) -> str:
    """Do a run in a folder of its own; return what was said."""
    listener = Listener()
    config = load_config(folder / "small.yaml", edits)
    place = RunFolder(folder / name)
    store = store or Store(folder / "store")
    assert Run(config, place, listener, ["test"], STAGES, store).execute("simulate") == []
    return listener.text


def test_runs_share_what_is_the_same(tmp_path: Path) -> None:
    write_small_run(tmp_path)
    assert "from the store" not in run(tmp_path, "a")
    said = run(tmp_path, "deeper/b")
    assert said.count("from the store") == 2
    first = {p.relative_to(tmp_path / "a") for p in (tmp_path / "a").rglob("*.*")}
    assert {p.relative_to(tmp_path / "deeper/b") for p in (tmp_path / "deeper/b").rglob("*.*")} == (
        first
    )
    said = run(tmp_path, "c", "simulate.seed=1")
    assert "ingest: 4 nodes, 3 links, 1 OD pairs, 100 trips (from the store)" in said
    assert said.count("from the store") == 1


def test_a_damaged_entry_is_made_anew_by_a_run(tmp_path: Path) -> None:
    write_small_run(tmp_path)
    run(tmp_path, "a")
    events = (tmp_path / "a/events.parquet").read_bytes()
    (entry,) = (path.parent for path in (tmp_path / "store").rglob("events.parquet"))
    (entry / "events.parquet").unlink()
    (entry / "events.parquet").write_bytes(b"damaged")
    said = run(tmp_path, "b")
    assert "is damaged; it is made anew" in said
    assert (tmp_path / "b/events.parquet").read_bytes() == events
    assert "is damaged" in (tmp_path / "b/run.log").read_text()
    assert run(tmp_path, "c").count("from the store") == 2


def test_a_source_that_changes_while_it_is_read_is_not_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_small_run(tmp_path)
    read = ingest.STAGE.run

    def read_and_change(task: Task) -> Outcome:
        outcome = read(task)
        (tmp_path / "net.tntp").write_text(NET.replace(" 1000 ", " 1100 "), encoding="utf-8")
        return outcome

    changing = replace(ingest.STAGE, run=read_and_change)
    monkeypatch.setattr(sys.modules[__name__], "STAGES", (changing, simulate.STAGE))
    run(tmp_path, "a")
    monkeypatch.undo()
    assert "ingest: 4 nodes, 3 links, 1 OD pairs, 100 trips (from the store)" not in run(
        tmp_path, "b"
    )
    write_small_run(tmp_path)
    assert run(tmp_path, "c").count("from the store") == 1  # the same tables: simulate alone


def test_optional_outputs_of_a_killed_run_do_not_stay(tmp_path: Path) -> None:
    write_small_run(tmp_path)
    run(tmp_path, "a")
    left = tmp_path / "b/network/signals.csv"
    left.parent.mkdir(parents=True)
    left.write_text("of a run that was killed")
    run(tmp_path, "b")
    assert not left.exists()
