"""OD tables in CSV and Parquet files: every form gives the same, every fault is told at once."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from od_files import values, write

from uxsim_geo.demand.od_files import OdColumns, read_od, read_od_matrix
from uxsim_geo.errors import InputError

ROWS = [["1", "2", 3.5], ["1", "10", 4.0], ["2", "1", 1.0], ["10", "2", 0.25]]

FORMS = {
    "plain": "origin,destination,vehicles\n1,2,3.5\n1,10,4\n2,1,1\n10,2,0.25\n",
    "windows": "origin,destination,vehicles\r\n1,2,3.5\r\n1,10,4\r\n2,1,1\r\n10,2,0.25\r\n",
    "byte-order mark": "\ufefforigin,destination,vehicles\n1,2,3.5\n1,10,4\n2,1,1\n10,2,0.25",
    "semicolons": "origin;destination;vehicles\n1;2;3.5\n1;10;4\n2;1;1\n10;2;0.25\n",
    "tabs": "origin\tdestination\tvehicles\n1\t2\t3.5\n1\t10\t4\n2\t1\t1\n10\t2\t0.25\n",
    "other names": "O,D,Ton\n1,2,3.5\n1,10,4\n2,1,1\n10,2,0.25\n",
    "GMNS": "orig_taz,dest_taz,total\n1,2,3.5\n1,10,4\n2,1,1\n10,2,0.25\n",
    "blanks, quotes and empty lines": (
        '\n"origin" , "destination",vehicles\n1, 2 ,3.5\n\n"1","10", 4\n2,1,1e0\n,,\n10,2,.25\n\n'
    ),
    "another order": "vehicles,destination,origin\n0.25,2,10\n1,1,2\n4,10,1\n3.5,2,1\n",
    "with zeros": "origin,destination,vehicles\n2,2,0\n1,2,3.5\n1,10,4\n2,1,1\n10,2,0.25\n",
    "a pair in two rows": "origin,destination,vehicles\n1,2,3\n1,10,4\n2,1,1\n10,2,0.25\n1,2,0.5\n",
}


@pytest.mark.parametrize("form", FORMS)
def test_every_form_of_csv_gives_the_same_table(tmp_path: Path, form: str) -> None:
    od = read_od(write(tmp_path, "od.csv", FORMS[form]))
    assert values(od.table) == ROWS
    assert od.table.dtypes.astype(str).tolist() == ["str", "str", "float64"]
    notes = od.notes.set_index("topic")["value"]
    assert notes["vehicles in file"] == "8.75"
    assert ("pairs summed" in notes) == (form == "a pair in two rows")


def test_lines_are_those_of_the_file(tmp_path: Path) -> None:
    od = read_od(write(tmp_path, "od.csv", FORMS["blanks, quotes and empty lines"]))
    assert od.table.index.name == "line"
    assert od.table.index.tolist() == [3, 5, 6, 8]


@pytest.mark.parametrize("kind", ["int64", "float64", "str"])
def test_parquet_gives_the_same_as_csv(tmp_path: Path, kind: str) -> None:
    table = pd.DataFrame({"origin": [10, 1, 2, 1], "destination": [2, 2, 1, 10]}).astype(kind)
    if kind == "str":
        table = table.replace(r"\.0", "", regex=True)
    table.assign(vehicles=[0.25, 3.5, 1, 4]).to_parquet(tmp_path / "od.parquet")
    assert values(read_od(tmp_path / "od.parquet").table) == ROWS


def test_the_order_of_rows_does_not_matter(tmp_path: Path) -> None:
    generator = np.random.default_rng(5)
    table = pd.DataFrame(
        {
            "origin": generator.integers(0, 12, 500),
            "destination": generator.integers(0, 12, 500),
            "vehicles": generator.random(500),
        }
    )
    table.to_csv(tmp_path / "a.csv", index=False)
    table.sample(frac=1, random_state=1).to_csv(tmp_path / "b.csv", index=False)
    first, second = (read_od(tmp_path / f"{name}.csv").table for name in "ab")
    # to the bit, although many rows were summed
    pd.testing.assert_frame_equal(
        first.reset_index(drop=True), second.reset_index(drop=True), check_exact=True
    )
    assert first["vehicles"].sum() == pytest.approx(table["vehicles"].sum(), rel=1e-12)


def test_times_and_classes(tmp_path: Path) -> None:
    text = "origin,destination,start_s,end_s,vehicles,class\n1,2,0,900,3,\n1,2,900,1800,4,truck\n"
    table = read_od(write(tmp_path, "od.csv", text)).table
    assert values(table) == [
        ["1", "2", 0.0, 900.0, 3.0, "default"],
        ["1", "2", 900.0, 1800.0, 4.0, "truck"],
    ]


def test_a_column_for_each_class(tmp_path: Path) -> None:
    text = "from_zone,to,car,hgv,note\na,b,3,1,x\nb,a,5,0,y\n"
    columns = OdColumns({"origin": "from_zone"}, {"car": "default", "hgv": "truck"})
    od = read_od(write(tmp_path, "od.csv", text), columns)
    assert values(od.table, "origin", "destination", "class", "vehicles") == [
        ["a", "b", "default", 3.0],
        ["a", "b", "truck", 1.0],
        ["b", "a", "default", 5.0],
    ]
    notes = od.notes.set_index("topic")["value"]
    assert notes["columns passed over"] == "note"
    assert notes["columns"] == (
        "origin: from_zone, destination: to, vehicles of default: car, vehicles of truck: hgv"
    )


def test_every_fault_with_its_line_column_and_value(tmp_path: Path) -> None:
    text = (
        "origin,destination,start_s,end_s,vehicles\n"
        "1,2,0,900,-3\n"  # 2
        ",2,0,900,4\n"  # 3
        "1,2,0,900,four\n"  # 4
        "1,2,900,900,4\n"  # 5
        "1,2,-1,900,4\n"  # 6
        "1,2,0,900,inf\n"  # 7
        "1,2,0,900,nan\n"  # 8
        "1,2,0,900,\n"  # 9
        "1,2,0,late,-4\n"  # 10
        "1,2,0,900,4\n"
    )
    path = write(tmp_path, "od.csv", text)
    with pytest.raises(InputError) as raised:
        read_od(path)
    lines = [(fault.line, fault.column, str(fault.value)) for fault in raised.value.faults]
    assert sorted(lines) == [
        (2, "vehicles", "-3.0"),
        (3, "origin", ""),
        (4, "vehicles", "four"),
        (5, "end_s", "900.0"),
        (6, "start_s", "-1.0"),
        (7, "vehicles", "inf"),
        (8, "vehicles", "nan"),
        (9, "vehicles", ""),
        (10, "end_s", "late"),
        (10, "vehicles", "-4.0"),
    ]
    assert all(str(path) in str(fault) for fault in raised.value.faults)


HEAD = "origin,destination,vehicles\n"
HOSTILE = {
    "too few values": (HEAD + "1,2,3\n1,2\n3,4,5\n", r"od.csv:3: has 2 values, line 1 names 3"),
    "too many values": (HEAD + "1,2,3\n1,2,3,4\n", r"od.csv:3: has 4 values"),
    "a decimal comma": (HEAD + "1,2,3,5\n", r"od.csv:2: has 4 values"),
    "an open quote": (HEAD + '1,2,3\n1,"2,3\n4,5,6\n', r"od.csv:3: a quotation mark is opened"),
    "a quote over lines": (HEAD + '1,"2\n3",4\n', r"od.csv"),
    "no such column": ("a,b,c\n1,2,3\n", r"lacks the column origin \(columns here: a, b, c\)"),
    "a column twice": ("origin,origin,vehicles\n1,2,3\n", r"column origin: two columns"),
    "one time only": ("origin,destination,vehicles,start_s\n1,2,3,0\n", "lacks the column end_s"),
    "no row": (HEAD, "holds no row"),
    "empty": ("", "is empty"),
    "blank": ("\n \n", "is empty"),
    "binary": ("origin\0", "binary file"),
    "a hexadecimal number": (HEAD + "1,2,0x1F_\n", r"od.csv:2, column vehicles: must be a number"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_files(tmp_path: Path, name: str) -> None:
    text, what = HOSTILE[name]
    with pytest.raises(InputError, match=what):
        read_od(write(tmp_path, "od.csv", text))


def test_files_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_od(tmp_path / "absent.csv")
    with pytest.raises(InputError, match="no such file"):
        read_od(tmp_path / "absent.parquet")
    with pytest.raises(InputError, match="not a Parquet table"):
        read_od(write(tmp_path, "od.parquet", "origin,destination\n"))
    (tmp_path / "latin.csv").write_bytes("origin,destination\nKöln,1\n".encode("latin-1"))
    with pytest.raises(InputError, match="not a text file in UTF-8"):
        read_od(tmp_path / "latin.csv")


def test_rows_of_parquet_are_named(tmp_path: Path) -> None:
    table = pd.DataFrame({"origin": [1.5, 2], "destination": [1, 2], "vehicles": [1.0, -2.0]})
    table.to_parquet(tmp_path / "od.parquet")
    with pytest.raises(InputError, match=r"row 1: must be an id.*1\.5"):
        read_od(tmp_path / "od.parquet")
    table.assign(origin=[1, 2]).to_parquet(tmp_path / "od.parquet")
    with pytest.raises(InputError, match=r"vehicles: row 2: must be .*'-2\.0'"):
        read_od(tmp_path / "od.parquet")


def test_columns_that_are_told_wrongly(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="must be one of origin"):
        OdColumns({"orign": "o"})
    with pytest.raises(InputError, match="beside classes"):
        OdColumns({"vehicles": "v"}, {"car": "default"})
    path = write(tmp_path, "od.csv", FORMS["plain"])
    with pytest.raises(InputError, match="column start: has no such column"):
        read_od(path, OdColumns({"origin": "start"}))
    with pytest.raises(InputError, match="column car: has no such column of vehicles"):
        read_od(path, OdColumns(classes={"car": "default"}))


MATRIX = "zone,1,2,10\n1,0,3.5,4\n2,1,0,\n10,,0.25,0\n"


def test_a_square_matrix_gives_the_same(tmp_path: Path) -> None:
    od = read_od_matrix(write(tmp_path, "matrix.csv", MATRIX))
    assert values(od.table) == ROWS
    wide = pd.DataFrame(
        {"zone": [1, 2, 10], "1": [0, 1, None], "2": [3.5, 0, 0.25], "10": [4, 0, 0]}
    )
    wide.to_parquet(tmp_path / "matrix.parquet")
    assert values(read_od_matrix(tmp_path / "matrix.parquet").table) == ROWS


@pytest.mark.parametrize(
    "text",
    [
        "zone,1,2,10\n1,0, 3.5,4\n\n2,1,0,\n10,,0.25,0\n\n",
        "zone;1;2;10\r\n1;0;3.5;4\r\n2;1;0;\r\n10;;.25;0",
        'zone,"1","2","10"\n"1","0","3.5","4"\n 2 ,1,0,\n10,,25e-2,0\n',
        "\n,10,2,1\n10,0,0.25,\n2,,0,1\n1,4,3.5,\n",
    ],
)
def test_every_form_of_a_matrix_gives_the_same(tmp_path: Path, text: str) -> None:
    assert values(read_od_matrix(write(tmp_path, "matrix.csv", text)).table) == ROWS


def test_lines_of_a_matrix_and_cells_that_are_no_number(tmp_path: Path) -> None:
    od = read_od_matrix(write(tmp_path, "matrix.csv", "zone,1,2\n\n1,0,3.5\n2,1,0\n"))
    assert od.table.index.tolist() == [3, 4]
    for cell in ("nan", "NaN", "-inf", "-1", "NA", "x"):
        path = write(tmp_path, "matrix.csv", f"zone,1,2\n1,0,3.5\n2,{cell},0\n")
        with pytest.raises(InputError, match=r":3, column 1: must be a") as raised:
            read_od_matrix(path)
        assert len(raised.value.faults) == 1
    with pytest.raises(InputError, match="has one column only"):
        read_od_matrix(write(tmp_path, "matrix.csv", "zone\n1\n"))
    for text in ("zone,1,2\n1,0\n2,1,0\n", "zone,1,2\n1,0,1,5\n2,1,0\n"):
        with pytest.raises(InputError, match=r":2: has . values, line 1 names 3 columns"):
            read_od_matrix(write(tmp_path, "matrix.csv", text))


def test_faults_of_a_matrix(tmp_path: Path) -> None:
    text = "zone,1,2,3\n1,0,x,4\n2,1,-1,0\n2,1,1,0\n4,0,inf,0\n"
    with pytest.raises(InputError) as raised:
        read_od_matrix(write(tmp_path, "matrix.csv", text))
    lines = {(fault.line, fault.column, fault.value) for fault in raised.value.faults}
    assert {(2, "2", "x"), (3, "2", "-1"), (5, "2", "inf")} <= lines
    message = str(raised.value)
    assert "row 4: the origin stands in an earlier row too (found '2')" in message
    assert "this place has no row (found '3')" in message
    assert "this place has no column (found '4')" in message


def test_long_form_and_matrix_agree_on_random_tables(tmp_path: Path) -> None:
    generator = random.Random(2)
    places = [str(place) for place in range(1, 9)]
    for _ in range(5):
        cells = {
            (a, b): round(generator.random() * 5, 3)
            for a in places
            for b in places
            if generator.random() < 0.6
        }
        long = HEAD + "".join(f"{a},{b},{v}\n" for (a, b), v in cells.items())
        square = "x," + ",".join(places) + "\n"
        for a in places:
            square += a + "," + ",".join(str(cells.get((a, b), "")) for b in places) + "\n"
        first = read_od(write(tmp_path, "long.csv", long)).table
        second = read_od_matrix(write(tmp_path, "square.csv", square)).table
        assert values(first) == values(second)
        assert len(first) == sum(value > 0 for value in cells.values())


def test_damaged_parquet_is_told_or_read(tmp_path: Path) -> None:
    """Whatever byte is wrong: a table, or an InputError, and nothing else."""
    table = pd.DataFrame({"origin": ["a", "b"], "destination": ["b", "a"], "vehicles": [1.0, 2.0]})
    table.to_parquet(tmp_path / "od.parquet")
    whole = (tmp_path / "od.parquet").read_bytes()
    generator = random.Random(3)
    refused = 0
    for _ in range(150):
        damaged = bytearray(whole)
        for _ in range(3):
            damaged[generator.randrange(len(damaged))] = generator.randrange(256)
        (tmp_path / "bad.parquet").write_bytes(bytes(damaged))
        try:
            read_od(tmp_path / "bad.parquet")
        except InputError:
            refused += 1
    assert refused > 50
