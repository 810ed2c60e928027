"""Signal tables of GMNS to plans and back."""

from __future__ import annotations

import math
from pathlib import Path

import pandas as pd
import pytest
from gmns_files import assert_same_network, crossing

from uxsim_geo.control.signals import Phase, Signal
from uxsim_geo.demand.demand import Demand
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.errors import InputError
from uxsim_geo.network.gmns import read_gmns_network
from uxsim_geo.network.gmns_signals import Signals, read_gmns_signals
from uxsim_geo.network.gmns_write import write_gmns_network
from uxsim_geo.network.network import Network
from uxsim_geo.settings import Settings

MOVEMENTS = ["mvmt_id,node_id,ib_link_id,ob_link_id"]
MOVEMENTS += [f"{a}{b},m,{a}m,m{b}" for a in "nesw" for b in "nesw" if a != b]

#: NEMA's eight phases: left turns lead, the rings meet when the arms change
PHASES = [
    "timing_phase_id,timing_plan_id,signal_phase_num,min_green,clearance,ring,barrier,position"
]
PHASES += ["1,p,1,10,4,1,1,1", "2,p,2,30,4,1,1,2", "3,p,3,8,4,1,2,1", "4,p,4,20,4,1,2,2"]
PHASES += ["5,p,5,20,4,2,1,1", "6,p,6,20,4,2,1,2", "7,p,7,8,4,2,2,1", "8,p,8,20,4,2,2,2"]

TURNS = {
    "1": "ne",
    "2": "sn sw",
    "5": "sw",
    "6": "ns nw",
    "3": "es",
    "4": "we ws",
    "7": "wn",
    "8": "ew en",
}
SHOWN = ["signal_phase_mvmt_id,timing_phase_id,mvmt_id,link_id,protection"]
SHOWN += [
    f"{phase}{turn},{phase},{turn},,protected"
    for phase, turns in TURNS.items()
    for turn in turns.split()
]

PLANS = ["timing_plan_id,controller_id,cycle_length", "p,c1,84"]


def write(folder: Path, **tables: list[str]) -> Network:
    network = crossing()
    write_gmns_network(network, folder)
    given = {
        "signal_controller": ["controller_id", "c1"],
        "signal_timing_plan": PLANS,
        "signal_timing_phase": PHASES,
        "signal_phase_mvmt": SHOWN,
        "movement": MOVEMENTS,
    }
    for name, rows in (given | tables).items():
        (folder / f"{name}.csv").write_text("\n".join([*rows, ""]), encoding="utf-8")
    return network


def read(folder: Path, **tables: list[str]) -> Signals:
    return read_gmns_signals(folder, write(folder, **tables))


def test_two_rings_become_one_sequence_of_greens(tmp_path: Path) -> None:
    (signal,), notes = read(tmp_path)
    assert signal.node_id == "m"
    assert signal.cycle == 84
    # the north arm has green in phases 1 (0 to 10) and 6 (24 to 44), the south arm in 5 (0 to 20)
    # and 2 (14 to 44): whoever drives on has green as long as any of its turns
    assert signal.greens() == {
        "nm": [(0, 10), (24, 44)],
        "sm": [(0, 44)],
        "em": [(48, 56), (60, 80)],
        "wm": [(48, 56), (60, 80)],
    }
    assert notes.empty


def test_the_plan_runs_in_the_engine_and_holds_vehicles(tmp_path: Path) -> None:
    network = write(tmp_path)
    (signal,), _ = read_gmns_signals(tmp_path, network)
    table = pd.DataFrame([("w", "e", 0.0, 300.0, 60.0)])
    table.columns = ["origin", "destination", "start_s", "end_s", "vehicles"]
    settings = Settings(600.0, 5)
    result = simulate(network, Demand(table), settings, control=[signal])
    passed = result.events[result.events["link"] == "wm"]["exit_s"].dropna()
    green = [(time - signal.offset) % 84 for time in passed]
    assert len(green) == 12
    assert all(48 - 1e-6 <= time <= 56 + 1e-6 or 60 - 1e-6 <= time <= 80 + 1e-6 for time in green)


def test_one_ring_is_taken_as_it_is(tmp_path: Path) -> None:
    phases = [PHASES[0], "a,p,1,30,5,1,1,1", "b,p,2,20,5,1,1,2"]
    shown = [SHOWN[0], "1,a,ns,,protected", "2,a,sn,,", "3,a,ne,,permitted", "4,b,ew,,rtor"]
    shown += ["5,b,we,,protected", "6,b,,crosswalk,protected"]
    plans = [PLANS[0], "p,c1,"]
    (signal,), notes = read(
        tmp_path, signal_timing_phase=phases, signal_phase_mvmt=shown, signal_timing_plan=plans
    )
    assert signal == Signal("m", (Phase(30, ("nm", "sm")), Phase(20, ("wm",))), all_red=5)
    assert notes["value"].tolist() == ["2"]


@pytest.mark.parametrize(
    ("row", "offset"),
    [
        ("1,p,c1,,,,17", 17.0),
        ("1,p,c1,,2,begin_of_green,17", 17.0 - 14),
        ("1,p,c1,,2,begin_of_yellow,17", 17.0 - 44),
    ],
)
def test_offsets_are_those_of_the_phase_that_is_coordinated(
    tmp_path: Path, row: str, offset: float
) -> None:
    header = "coordination_id,timing_plan_id,controller_id,coord_contr_id,coord_phase"
    header += ",coord_ref_to,offset"
    (signal,), _ = read(tmp_path, signal_coordination=[header, row])
    assert signal.offset == offset


def test_detectors_are_told_of(tmp_path: Path) -> None:
    phases = [f"{PHASES[0]},max_green", *(f"{row},99" for row in PHASES[1:])]
    _, notes = read(tmp_path, signal_timing_phase=phases)
    assert notes["topic"].tolist() == ["actuated signals"]
    assert notes["value"].tolist() == ["8"]


def test_one_plan_of_several_is_to_be_stated(tmp_path: Path) -> None:
    plans = [*PLANS, "q,c1,50"]
    phases = [*PHASES, "q1,q,1,25,0,1,1,1", "q2,q,2,25,0,1,1,2"]
    shown = [*SHOWN, "x,q1,ns,,", "y,q2,ew,,"]
    tables = {
        "signal_timing_plan": plans,
        "signal_timing_phase": phases,
        "signal_phase_mvmt": shown,
    }
    with pytest.raises(InputError, match="controller c1 has the plans p, q: state which to read"):
        read(tmp_path, **tables)
    (signal,), _ = read_gmns_signals(tmp_path, crossing(), timing_plans=["q"])
    assert signal.phases == (Phase(25, ("nm",)), Phase(25, ("em",)))
    with pytest.raises(InputError, match="there is no such plan"):
        read_gmns_signals(tmp_path, crossing(), timing_plans=["ghost"])


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ("2,p,2,30,4,1,1,2", "2,p,2,31,4,1,1,2", "are at barrier 1 after 49 s, 48 s"),
        ("p,c1,84", "p,c1,90", "last 84 s, its cycle 90 s"),
        ("2,p,2,30,4", "2,p,2,-30,4", "must not be negative"),
        ("2,p,2,30,4", "2,p,2,,4", "needs a value"),
        ("2,p,2,30,4", "1,p,2,30,4", "stands on line 2 too"),
        ("2,p,2,30,4", "2,x,2,30,4", "refers to a timing_plan that is not there"),
        ("4we,4,we", "4we,9,we", "refers to a timing_phase that is not there"),
        ("4we,4,we", "4we,4,zz", "refers to a mvmt that is not there"),
        ("min_green", "green", "lacks the column min_green"),
    ],
)
def test_faults_of_signal_tables(tmp_path: Path, old: str, new: str, what: str) -> None:
    tables = {
        "signal_timing_plan": PLANS,
        "signal_timing_phase": PHASES,
        "signal_phase_mvmt": SHOWN,
    }
    changed = {name: [row.replace(old, new) for row in rows] for name, rows in tables.items()}
    assert changed != tables
    with pytest.raises(InputError, match=what):
        read(tmp_path, **changed)


def test_folders_without_signal_tables(tmp_path: Path) -> None:
    write_gmns_network(crossing(), tmp_path)
    with pytest.raises(InputError) as raised:
        read_gmns_signals(tmp_path, crossing())
    assert [Path(fault.source).stem for fault in raised.value.faults] == [
        "signal_timing_plan",
        "signal_timing_phase",
        "signal_phase_mvmt",
        "movement",
    ]


def test_signals_come_back(tmp_path: Path) -> None:
    signals = (
        Signal("m", (Phase(30.5, ("nm", "sm")), Phase(20, ("em",)), Phase(1 / 3, ())), 7.25, 2.5),
        Signal("n", (Phase(12, ("mn",)), Phase(8, ()))),
        Signal("s", (Phase(10, ("ms",)), Phase(10, ())), begin=100.0, end=900.0),
        Signal("s", (Phase(20, ("ms",)), Phase(20, ())), begin=900.0),
    )
    network = crossing()
    write_gmns_network(network, tmp_path, signals=signals)
    back = read_gmns_network(tmp_path)
    assert_same_network(back, network)
    plans, notes = read_gmns_signals(tmp_path, back)
    assert plans == signals
    assert math.isinf(plans[3].end)
    assert notes.empty


def test_plans_that_gmns_cannot_say_are_faults(tmp_path: Path) -> None:
    signals = [Signal("m", (Phase(10, ("nm",)), Phase(10, ("mn", "ghost"))), offset=-5)]
    with pytest.raises(InputError) as raised:
        write_gmns_network(crossing(), tmp_path / "out", signals=signals)
    assert [(fault.column, fault.value) for fault in raised.value.faults] == [
        ("offset", "-5"),
        ("phases", "mn"),
        ("phases", "ghost"),
    ]
    assert not (tmp_path / "out").exists()
