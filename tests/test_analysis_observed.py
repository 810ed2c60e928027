"""Comparison with what was observed: figures by hand, files, and everything wrong with them."""

from __future__ import annotations

import gzip
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from drives import crowded_grid

from uxsim_geo.analysis.link_states import link_times
from uxsim_geo.analysis.observations import read_counts, read_travel_times
from uxsim_geo.analysis.observed import compare_counts, compare_travel_times
from uxsim_geo.analysis.skims import skims
from uxsim_geo.demand.count_adjustment import geh
from uxsim_geo.errors import InputError

NAN = np.nan


def states() -> pd.DataFrame:
    """Two links in three bins of 600 s."""
    return pd.DataFrame(
        {
            "link_id": pd.Categorical(["north"] * 3 + ["south"] * 3),
            "begin_s": [0.0, 600.0, 1200.0] * 2,
            "end_s": [600.0, 1200.0, 1800.0] * 2,
            "entries": [10.0, 20.0, 30.0, 0.0, 0.0, 15.0],
            "exits": [5.0, 15.0, 25.0, 0.0, 0.0, 0.0],
            "experienced_travel_time": [50.0, 70.0, 60.0, NAN, NAN, NAN],
        }
    )


def counts(*rows: tuple[str, float, float, float]) -> pd.DataFrame:
    return pd.DataFrame(rows, columns=["link_id", "start_s", "end_s", "vehicles"])


def test_geh_by_hand() -> None:
    # 2·20² / 200 = 4 and 2·50² / 50 = 100
    found = geh(np.array([90.0, 50.0, 0.0, 7.0]), np.array([110.0, 0.0, 0.0, 7.0]))
    assert found.tolist() == [2.0, 10.0, 0.0, 0.0]


def test_counts_over_one_and_several_bins() -> None:
    observed = counts(
        ("south", 1200, 1800, 15), ("north", 0, 1200, 24), ("north", 600, 1800, 51)
    )  # fmt: skip
    table, figures = compare_counts(observed, states())
    assert table["link_id"].tolist() == ["south", "north", "north"]
    assert table["simulated_vehicles"].tolist() == [15.0, 30.0, 50.0]
    assert table["observed_flow_vph"].tolist() == [90.0, 72.0, 153.0]
    assert table["simulated_flow_vph"].tolist() == [90.0, 90.0, 150.0]
    assert table["geh"].to_numpy() == pytest.approx(
        [0.0, np.sqrt(2 * 18**2 / 162), np.sqrt(2 * 3**2 / 303)]
    )
    rmse = np.sqrt((18**2 + 3**2) / 3)
    assert figures == {
        "compared": 3.0,
        "mean_error_vph": pytest.approx(5.0),
        "rmse_vph": pytest.approx(rmse),
        "relative_rmse": pytest.approx(rmse / 105),
        "r_squared": pytest.approx(1 - 333 / (15**2 + 33**2 + 48**2)),
        "share_under_geh_5": 1.0,
    }
    exits = compare_counts(observed, states(), at="exits")
    assert exits.table["simulated_vehicles"].tolist() == [0.0, 20.0, 40.0]
    assert exits.figures["share_under_geh_5"] == pytest.approx(2 / 3)


def test_one_observation_has_no_spread_to_explain() -> None:
    figures = compare_counts(counts(("south", 0, 600, 0)), states()).figures
    assert (figures["rmse_vph"], figures["share_under_geh_5"]) == (0.0, 1.0)
    assert np.isnan([figures["relative_rmse"], figures["r_squared"]]).all()


def test_travel_times_of_links_weigh_by_vehicles() -> None:
    observed = pd.DataFrame(
        {
            "link_id": ["north", "south", "north"],
            "start_s": [0.0, 0.0, 1200.0],
            "end_s": [1200.0, 1800.0, 1800.0],
            "travel_time_s": [60.0, 40.0, 65.0],
        }
    )
    table, figures = compare_travel_times(observed, states())
    assert table["vehicles"].tolist() == [20.0, 0.0, 25.0]
    assert table["simulated_travel_time_s"].to_numpy() == pytest.approx(
        [65.0, NAN, 60.0], nan_ok=True
    )
    assert figures["compared"] == 2
    assert (figures["mean_error_s"], figures["rmse_s"]) == (0.0, 5.0)
    assert figures["relative_rmse"] == 5.0 / 62.5
    assert figures["r_squared"] == pytest.approx(1 - 50 / 12.5)
    nothing = compare_travel_times(observed.iloc[[1]], states()).figures
    assert nothing["compared"] == 0
    assert np.isnan(nothing["rmse_s"])


def test_a_run_agrees_with_itself() -> None:
    of, result = crowded_grid()
    table = link_times(result, of, bin_s=100.0)
    observed = table.rename(
        columns={"begin_s": "start_s", "entries": "vehicles"}
    ).sample(frac=1, random_state=2)  # fmt: skip
    found, figures = compare_counts(observed, table)
    assert found["simulated_vehicles"].tolist() == observed["vehicles"].tolist()
    assert (figures["rmse_vph"], figures["r_squared"]) == (0.0, 1.0)
    assert figures["share_under_geh_5"] == 1.0
    wide = link_times(result, of, bin_s=400.0)
    wide = wide.rename(columns={"begin_s": "start_s", "entries": "vehicles"})
    assert compare_counts(wide, table).figures["rmse_vph"] == pytest.approx(0.0, abs=1e-9)


def test_travel_times_of_pairs_agree_with_skims_of_longer_slices() -> None:
    of, result = crowded_grid()
    name = "experienced_travel_time_completed_only_s"
    wide = skims(result, of, bin_s=400.0).dropna(subset=name)
    observed = wide.rename(columns={"begin_s": "start_s", name: "travel_time_s"})
    found, figures = compare_travel_times(observed, skims(result, of, bin_s=100.0))
    assert found["vehicles"].tolist() == wide["vehicles_completed"].tolist()
    assert figures["compared"] == len(wide)
    assert figures["rmse_s"] == pytest.approx(0.0, abs=1e-9)


def test_every_observation_that_is_wrong_is_named() -> None:
    observed = counts(
        ("north", 0, 600, -1),
        ("north", 600, 600, 3),
        ("north", 0, 600, 3),
        ("north", -600, 600, NAN),
    )
    with pytest.raises(InputError) as error:
        compare_counts(observed, states())
    assert str(error.value).splitlines() == [
        "observed, column start_s: row 3: must be a number of seconds, 0 or more (found '-600')",
        "observed, column end_s: row 1: must be later than start_s (found '600')",
        "observed, column vehicles: row 0: must be a number, 0 or more (found '-1.0')",
        "observed, column vehicles: row 3: must be a number, 0 or more (found 'nan')",
        "observed, column link_id: row 2: is observed in this interval already, in an earlier line"
        " (found 'north')",
    ]


def test_observations_of_what_was_not_simulated_are_refused() -> None:
    observed = counts(("east", 0, 600, 1), ("north", 0, 900, 3), ("north", 1200, 2400, 3))
    with pytest.raises(InputError) as error:
        compare_counts(observed, states())
    faults = error.value.faults
    assert [(fault.column, fault.value) for fault in faults] == [
        ("link_id", "east"),
        ("end_s", 900),
        ("end_s", 2400),
    ]
    assert "from 0 to 1800 s, the first up to 600 s" in faults[1].what
    with pytest.raises(InputError, match="holds no observation"):
        compare_counts(counts(), states())
    with pytest.raises(InputError, match="simulated: lacks the column begin_s"):
        compare_counts(observed, states().drop(columns="begin_s"))
    with pytest.raises(InputError, match="lacks the column vehicles"):
        compare_counts(observed.drop(columns="vehicles"), states())
    pairs = pd.DataFrame(
        {"origin": "a", "destination": "b", "start_s": [0], "end_s": [600], "travel_time_s": [1]}
    )
    with pytest.raises(InputError, match="simulated: lacks the column origin"):
        compare_travel_times(pairs, states())


def written(folder: Path, text: str) -> Path:
    path = folder / "observed.csv"
    path.write_bytes(text.encode())
    return path


def test_a_file_of_counts(tmp_path: Path) -> None:
    text = "\ufeffvehicles, link_id,start_s,end_s\r\n12.5,007,0,600\r\n\r\n3,north,600,1200\r\n"
    table = read_counts(written(tmp_path, text))
    assert table.columns.tolist() == ["link_id", "start_s", "end_s", "vehicles"]
    assert table["link_id"].tolist() == ["007", "north"]  # ids stay text
    assert table["vehicles"].tolist() == [12.5, 3.0]
    assert table.index.tolist() == [2, 4]  # lines


def test_files_of_travel_times(tmp_path: Path) -> None:
    text = "origin,destination,start_s,end_s,travel_time_s\n1,2,0,600,90\n"
    assert read_travel_times(written(tmp_path, text))["destination"].tolist() == ["2"]
    text = "link_id,start_s,end_s,travel_time_s\n1,0,600,90\n"
    assert read_travel_times(written(tmp_path, text))["link_id"].tolist() == ["1"]


HEAD = "link_id,start_s,end_s,vehicles\n"


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        ("", ["is empty"]),
        ("link,start_s,end_s,vehicles\n1,0,600,3\n", [":1: the first line must name the columns"]),
        (HEAD.replace("\n", ",name\n") + "1,0,600,3,x\n", [":1: the first line must name"]),
        (HEAD, ["holds no observation"]),
        (
            HEAD + "1,0,600\n,0,600,3\n2,0,x,3\n3,0,600,3,4\n",
            [
                ":2: has 3 values",
                ":3, column link_id: needs an id",
                ":4, column end_s: must be a number (found 'x')",
                ":5: has 5 values",
            ],
        ),
        (
            HEAD + "1,600,0,3\n2,0,600,-3\n3,0,600,nan\n4,0,600,1\n4,0,600,1\n",
            [
                ":2, column end_s: must be later than start_s",
                ":3, column vehicles: must be a number, 0 or more",
                ":4, column vehicles: must be a number, 0 or more",
                ":6, column link_id: is observed in this interval already",
            ],
        ),
        (HEAD + '1,0,"600,3\n', ["is no table of commas"]),
    ],
)
def test_every_fault_of_a_file_stands_at_its_line(
    tmp_path: Path, text: str, faults: list[str]
) -> None:
    path = written(tmp_path, text)
    with pytest.raises(InputError) as error:
        read_counts(path)
    lines = str(error.value).splitlines()
    assert len(lines) == len(faults), lines
    for line, wanted in zip(lines, faults, strict=True):
        assert line.startswith(str(path))
        assert wanted in line


def test_faults_of_the_comparison_name_the_file_and_line(tmp_path: Path) -> None:
    path = written(tmp_path, HEAD + "north,0,600,3\n\neast,0,700,3\n")
    with pytest.raises(InputError) as error:
        compare_counts(read_counts(path), states())
    lines = str(error.value).splitlines()
    assert lines[0].startswith(f"{path}:4, column link_id: there is nothing of this name")
    assert lines[1].startswith(f"{path}:4, column end_s: must begin or end a simulated bin")


def test_measured_counts_can_be_read_and_compared(shared: Path, tmp_path: Path) -> None:
    """Hourly means of a city's detectors, with fractions of vehicles and a whole day each."""
    archive = shared / "data" / "counts" / "berlin-v6.1-counts-vmz.xml.gz"
    if not archive.is_file():
        pytest.skip("the measured counts are not here")
    space = "{http://www.matsim.org/files/dtd}"
    with gzip.open(archive) as stream:
        root = ElementTree.parse(stream).getroot()
    rows = [
        ",".join((place.attrib["refId"], begin, str(int(begin) + 3600), value.attrib["val"]))
        for place in root.iter(f"{space}location")
        for measured in place.iter(f"{space}measurements")
        if measured.get("networkMode") == "car" and measured.get("type") == "volumes"
        for value in measured.iter(f"{space}value")
        for begin in [value.attrib["t"]]
    ]
    observed = read_counts(written(tmp_path, HEAD + "\n".join(rows) + "\n"))
    assert len(observed) == len(rows) > 1000
    simulated = observed.rename(columns={"start_s": "begin_s"})
    simulated = simulated.assign(entries=1.1 * simulated["vehicles"])
    figures = compare_counts(observed, simulated).figures
    assert figures["mean_error_vph"] == pytest.approx(0.1 * observed["vehicles"].mean())
    # with M = 1.1 C the GEH is under 5 as long as 2 (C/10)² < 25 · 2.1 C, that is C < 2,625
    assert figures["share_under_geh_5"] == (observed["vehicles"] < 2625).mean()
