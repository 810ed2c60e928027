"""Events that go to a file while the run goes on: the same rows and bytes however it is cut."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from drives import crowded_grid
from small_networks import across, grid, network

from uxsim_geo.demand.demand import Demand
from uxsim_geo.engine import arrays, sinks
from uxsim_geo.engine.simulation import Simulation, simulate
from uxsim_geo.engine.sinks import InMemory, ToFile, to_file
from uxsim_geo.errors import InputError
from uxsim_geo.events import COLUMNS, EventFile, EventTable
from uxsim_geo.network.network import Network
from uxsim_geo.parquet import write_table
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

SETTINGS = Settings(800.0, seed=3)


def case() -> tuple[Network, Demand]:
    """The case of :func:`drives.crowded_grid`, of which some drive at the end."""
    return network(grid(5)), across(5, 40, 900.0)


def into_file(path: Path, rows: int, stops: tuple[float, ...] = ()) -> Result:
    """Run the case with its events going to a file in row groups of so many rows."""
    with to_file(path, rows) as sink:
        run = Simulation(*case(), SETTINGS, sink=sink)
        for stop in (*stops, SETTINGS.duration):
            run.advance(stop)
        return run.result()


def test_a_file_holds_what_memory_would(tmp_path: Path) -> None:
    _, kept = crowded_grid()
    streamed = simulate(*case(), SETTINGS, events_file=tmp_path / "events.parquet")
    assert len(streamed.log) == len(kept.events) > 0
    assert kept.events["exit_s"].isna().any()
    pd.testing.assert_frame_equal(streamed.events, kept.events)
    pd.testing.assert_frame_equal(pd.read_parquet(tmp_path / "events.parquet"), kept.events)
    pd.testing.assert_frame_equal(streamed.trips, kept.trips)
    assert [path.name for path in tmp_path.iterdir()] == ["events.parquet"]


@pytest.mark.parametrize("rows", [7, 1000])
def test_bytes_do_not_depend_on_how_the_run_is_cut(
    tmp_path: Path, rows: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    into_file(tmp_path / "once.parquet", rows)
    monkeypatch.setattr(arrays, "_EVENT_BUFFER", 1)  # and the fullest link, which there must be
    into_file(tmp_path / "cut.parquet", rows, stops=tuple(np.arange(3.0, 800.0, 41.0)))
    once, cut = ((tmp_path / name).read_bytes() for name in ("once.parquet", "cut.parquet"))
    assert once == cut
    whole = pq.read_metadata(tmp_path / "once.parquet")
    groups = [whole.row_group(number).num_rows for number in range(whole.num_row_groups)]
    assert set(groups[:-1]) == {rows}
    assert sum(groups) == len(crowded_grid()[1].log)


def test_blocks_of_memory_grow_and_give_one_table(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sinks, "_FIRST_BLOCK", 3)
    monkeypatch.setattr(sinks, "_LARGEST_BLOCK", 17)
    pd.testing.assert_frame_equal(simulate(*case(), SETTINGS).events, crowded_grid()[1].events)


def test_a_run_can_go_on_after_it_has_given_its_tables() -> None:
    run = Simulation(*case(), SETTINGS)
    run.advance(SETTINGS.duration)
    first = run.result().events
    first.loc[:, "exit_s"] = 0.0  # whoever changes a table changes that one alone
    again = run.result().events
    pd.testing.assert_frame_equal(again, crowded_grid()[1].events)
    late = Demand(across(5, 5, 10.0).table.assign(start_s=800.0, end_s=900.0))
    run.add(late)
    pd.testing.assert_frame_equal(run.result().events, again)


def test_what_needs_all_events_refuses_a_file(tmp_path: Path) -> None:
    sink = ToFile(tmp_path / "events.parquet")
    run = Simulation(*case(), SETTINGS, sink=sink)
    run.advance(400.0)
    with pytest.raises(InputError, match="has a result at its end"):
        run.result()
    with pytest.raises(InputError, match="to be saved keeps them"):
        run.save(tmp_path / "saved.zip")
    sink.close()


def test_a_file_of_a_run_that_stopped_before_its_end_does_not_appear(tmp_path: Path) -> None:
    def stop_early() -> None:
        with to_file(tmp_path / "events.parquet") as sink:
            Simulation(*case(), SETTINGS, sink=sink).advance(400.0)

    with pytest.raises(InputError, match="not been brought to its end"):
        stop_early()
    assert not list(tmp_path.iterdir())


def test_nothing_is_left_of_a_run_that_fails(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError):
        simulate(*case(), SETTINGS, progress=lambda _: 1 // 0, events_file=tmp_path / "e.parquet")
    assert not list(tmp_path.iterdir())


def test_a_run_without_entries_leaves_a_file_without_rows(tmp_path: Path) -> None:
    of, demand = case()
    nobody = Demand(demand.table.iloc[:0])
    result = simulate(of, nobody, SETTINGS, events_file=tmp_path / "events.parquet")
    pd.testing.assert_frame_equal(result.events, simulate(of, nobody, SETTINGS).events)


@pytest.mark.parametrize("rows", [1, 7, 100_000])
def test_some_rows_are_those_of_the_whole_table(tmp_path: Path, rows: int) -> None:
    of, kept = crowded_grid()
    path = tmp_path / "events.parquet"
    into_file(path, rows)
    links = np.arange(len(of.links)) % 3 == 0
    vehicles = np.arange(len(kept.trips)) % 5 == 0
    code, vehicle = kept.events["link"].cat.codes.to_numpy(), kept.events["vehicle"].to_numpy()
    meant = {
        (): np.ones(len(code), bool),
        ("links",): links[code],
        ("vehicles",): vehicles[vehicle],
        ("links", "vehicles"): links[code] & vehicles[vehicle],
    }
    chosen = {"links": links, "vehicles": vehicles}
    for log in (EventFile(path, kept.log.link_ids), EventTable(kept.events, piece=rows)):
        assert sum(len(piece["link"]) for piece in log.pieces("link")) == len(log)
        for names, expected in meant.items():
            found = log.some(*COLUMNS, **{name: chosen[name] for name in names})
            assert found["link"].tolist() == code[expected].tolist()
            for name in ("vehicle", "enter_s", "exit_s"):
                np.testing.assert_array_equal(found[name], kept.events[name][expected])


def test_a_file_that_another_program_wrote_again_is_read(tmp_path: Path) -> None:
    _, kept = crowded_grid()
    path = tmp_path / "events.parquet"
    write_table(kept.events.astype({"link": "str", "vehicle": "int64"}), path)
    pd.testing.assert_frame_equal(EventFile(path, kept.log.link_ids).table(), kept.events)


def test_a_file_that_is_none_or_another_one_is_told(tmp_path: Path) -> None:
    _, kept = crowded_grid()
    path = tmp_path / "events.parquet"
    with pytest.raises(InputError, match="there is no such file"):
        EventFile(path, kept.log.link_ids)
    path.write_text("no table")
    with pytest.raises(InputError, match="is not a Parquet table"):
        EventFile(path, kept.log.link_ids)
    write_table(kept.trips, path)
    with pytest.raises(InputError, match="column link: lacks this column"):
        EventFile(path, kept.log.link_ids)
    write_table(kept.events, path)
    log = EventFile(path, pd.Index(["elsewhere"]))
    with pytest.raises(InputError, match="is it of another run"):
        log.table()
    path.write_bytes(path.read_bytes()[:4] + b"x" * 50 + path.read_bytes()[54:])
    with pytest.raises(InputError, match="is not a Parquet table"):
        EventFile(path, kept.log.link_ids).table()


def test_memory_keeps_what_it_is_given_and_no_view_of_it() -> None:
    sink = InMemory()
    sink.begin(np.array([1, 0]), pd.Index(["a", "b"]))
    events = np.zeros(3, sinks.EVENT)
    events["trip"] = [4, 5, 6]
    sink.add(events)
    events["trip"] = 0
    assert sink.records()["trip"].tolist() == [4, 5, 6]
    table = sink.log([events[:1]], last=True).table()
    assert table["vehicle"].tolist() == [4, 5, 6, 0]
    assert table["link"].tolist() == ["b"] * 4
    assert sink.records()["link"].tolist() == [0, 0, 0]
