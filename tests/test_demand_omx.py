"""OMX matrices: written with plain HDF5 calls as the format asks, and told apart when broken."""

from __future__ import annotations

import random
import sys
from pathlib import Path

import numpy as np
import pytest
from od_files import values, write

from uxsim_geo.demand.omx import MOST_CELLS, OmxCore, read_omx
from uxsim_geo.errors import InputError

h5py = pytest.importorskip("h5py")

CAR = np.array([[0.0, 3.5, 4.0], [1.0, 0.0, 0.0], [0.0, 0.25, 2.0]])
ZONES = [1, 2, 10]
ROWS = [["1", "2", 3.5], ["1", "10", 4.0], ["2", "1", 1.0], ["10", "2", 0.25], ["10", "10", 2.0]]


def omx(
    path: Path,
    cores: dict[str, np.ndarray],
    lookups: dict[str, object] | None = None,
    shape: tuple[int, int] | None = (3, 3),
) -> Path:
    with h5py.File(path, "w") as file:
        file.attrs["OMX_VERSION"] = np.bytes_("0.2")
        if shape is not None:
            file.attrs["SHAPE"] = np.array(shape, np.int32)
        data, lookup = file.create_group("data"), file.create_group("lookup")
        for name, core in cores.items():
            data.create_dataset(name, data=core, chunks=True, compression="gzip", shuffle=True)
        for name, zones in (lookups or {}).items():
            lookup.create_dataset(name, data=zones)
    return path


@pytest.mark.parametrize("kind", ["int32", "float64", "S5", "vlen"])
def test_cells_by_the_names_of_the_zones(tmp_path: Path, kind: str) -> None:
    zones = [str(zone) for zone in ZONES] if kind == "vlen" else np.array(ZONES).astype(kind)
    od = read_omx(omx(tmp_path / "od.omx", {"car": CAR}, {"zone": zones}))
    assert values(od.table) == ROWS
    assert od.notes.set_index("topic")["value"]["vehicles in file"] == "10.75"


def test_without_a_lookup_zones_are_numbered(tmp_path: Path) -> None:
    od = read_omx(omx(tmp_path / "od.omx", {"car": CAR}, shape=None))
    assert values(od.table)[1] == ["1", "3", 4.0]
    assert od.notes.set_index("topic")["value"]["zones"] == "3"


def test_cores_by_class_and_period(tmp_path: Path) -> None:
    cores = {"am_car": CAR, "am_hgv": CAR.T / 2, "md_car": CAR * 2, "distance": CAR}
    path = omx(tmp_path / "od.omx", cores, {"zone": ZONES})
    chosen = [
        OmxCore("am_car", None, 0.0, 3600.0),
        OmxCore("md_car", None, 3600.0, 7200.0),
        OmxCore("am_hgv", "truck", 0.0, 3600.0),
    ]
    od = read_omx(path, chosen)
    first = od.table.query("origin == '1' and destination == '2'")
    assert values(first) == [
        ["1", "2", 0.0, 3600.0, 3.5, "default"],
        ["1", "2", 3600.0, 7200.0, 7.0, "default"],
        ["1", "2", 0.0, 3600.0, 0.5, "truck"],
    ]
    assert od.notes.set_index("topic")["value"]["cores"] == "distance"
    assert od.table["vehicles"].sum() == pytest.approx(CAR.sum() * 3.5)


def test_the_value_for_nothing_is_nothing(tmp_path: Path) -> None:
    for nothing in (-1.0, np.nan):
        path = omx(tmp_path / "od.omx", {"car": np.where(CAR == 0, nothing, CAR)}, {"zone": ZONES})
        with h5py.File(path, "a") as file:
            file["data/car"].attrs["NA"] = nothing
        assert values(read_omx(path).table) == ROWS


def test_a_large_matrix_is_read_in_pieces(tmp_path: Path) -> None:
    matrix = np.random.default_rng(0).random((2100, 2100)).astype(np.float32)
    matrix[matrix < 0.9] = 0.0
    od = read_omx(omx(tmp_path / "od.omx", {"car": matrix}, shape=(2100, 2100)))
    assert len(od.table) == np.count_nonzero(matrix)
    back = np.zeros_like(matrix)
    at = od.table[["origin", "destination"]].astype(int).to_numpy() - 1
    back[at[:, 0], at[:, 1]] = od.table["vehicles"]
    assert np.array_equal(back, matrix)


def test_faults_of_cores_and_lookups(tmp_path: Path) -> None:
    cores = {"car": CAR, "hgv": CAR}
    lookups = {"zone": ZONES, "name": ["a", "a", "c"], "short": [1, 2]}
    path = omx(tmp_path / "od.omx", cores, lookups)
    car = [OmxCore("car")]
    for given, lookup, what in (
        ((), "zone", r"has several cores.*: car, hgv"),
        ([OmxCore("bus")], "zone", r"no such core \(there are: car, hgv\) \(found 'bus'\)"),
        ([OmxCore("car"), OmxCore("car")], "zone", "named twice"),
        ([OmxCore("car", None, 0.0)], "zone", "both start_s and end_s"),
        ([OmxCore("car", None, 0.0, 9.0), OmxCore("hgv")], "zone", "or no core may have any"),
        ([OmxCore("car", None, 9.0, 9.0)], "zone", "must be later than start_s"),
        (car, None, r"has several lookups.*name, short, zone"),
        (car, "no", r"no such lookup \(there are: name, short, zone\)"),
        (car, "name", r"lookup name: must name every zone, and no two alike \(found 'a'\)"),
        (car, "short", r"lookup short: must have the name of each of the 3 zones"),
    ):
        with pytest.raises(InputError, match=what):
            read_omx(path, given, lookup=lookup)


def test_faults_of_matrices(tmp_path: Path) -> None:
    cores = {"wide": CAR[:2], "text": CAR.astype("S3"), "deep": CAR[None]}
    path = omx(tmp_path / "od.omx", cores)
    with pytest.raises(InputError) as raised:
        read_omx(path, [OmxCore(name) for name in cores])
    message = str(raised.value)
    assert "core wide: must be square" in message
    assert "core wide: is not of the size that the file declares, [3, 3]" in message
    assert message.count("must be a matrix of numbers") == 2
    bad = CAR.copy()
    bad[0, 2], bad[1, 0], bad[2, 1] = np.nan, -1.0, np.inf
    with pytest.raises(InputError) as raised:
        read_omx(omx(tmp_path / "bad.omx", {"car": bad}, {"zone": ZONES}))
    assert [str(fault.value) for fault in raised.value.faults] == ["nan", "-1.0", "inf"]
    assert "core car: must be" in str(raised.value)
    assert "from zone 10 to 2" in str(raised.value)


def test_files_that_are_none_or_reach_elsewhere(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_omx(tmp_path / "absent.omx")
    with pytest.raises(InputError, match="is no OMX file"):
        read_omx(write(tmp_path, "text.omx", "no matrix"))
    whole = omx(tmp_path / "whole.omx", {"car": CAR})
    cut = tmp_path / "cut.omx"
    cut.write_bytes(whole.read_bytes()[:-500])
    with pytest.raises(InputError, match="is no OMX file"):
        read_omx(cut)
    with h5py.File(tmp_path / "empty.omx", "w"):
        pass
    with pytest.raises(InputError, match="no group data"):
        read_omx(tmp_path / "empty.omx")
    with h5py.File(tmp_path / "linked.omx", "w") as file:
        data = file.create_group("data")
        data["elsewhere"] = h5py.ExternalLink(str(whole), "/data/car")
        layout = h5py.VirtualLayout((3, 3), "f8")
        layout[:] = h5py.VirtualSource(str(whole), "data/car", (3, 3))
        data.create_virtual_dataset("virtual", layout)
        (tmp_path / "raw.bin").write_bytes(CAR.tobytes())
        data.create_dataset("external", (3, 3), "f8", external=[(str(tmp_path / "raw.bin"), 0, 72)])
    with pytest.raises(InputError) as raised:
        read_omx(tmp_path / "linked.omx", [OmxCore("virtual")])
    message = str(raised.value)
    assert "data/elsewhere: is a link to elsewhere" in message
    assert "data/virtual: has its values in another file" in message
    assert "data/external: has its values in another file" in message


def test_a_matrix_that_does_not_fit_is_not_read(tmp_path: Path) -> None:
    side = int(MOST_CELLS**0.5) + 1
    with h5py.File(tmp_path / "huge.omx", "w") as file:
        file.create_group("data").create_dataset("car", (side, side), "f8", chunks=(64, 64))
    with pytest.raises(InputError, match="has over 100,000,000 cells"):
        read_omx(tmp_path / "huge.omx")


def test_without_h5py_the_message_names_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = omx(tmp_path / "od.omx", {"car": CAR})
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(InputError, match=r'pip install "uxsim-geo\[omx\]"'):
        read_omx(path)


def test_a_damaged_file_is_told_or_read(tmp_path: Path) -> None:
    """Whatever byte is wrong: a table, or an InputError, and nothing else."""
    whole = omx(tmp_path / "od.omx", {"car": CAR}, {"zone": ZONES}).read_bytes()
    generator = random.Random(3)
    refused = 0
    for _ in range(300):
        damaged = bytearray(whole)
        for _ in range(20):
            damaged[generator.randrange(len(damaged))] = generator.randrange(256)
        (tmp_path / "bad.omx").write_bytes(bytes(damaged))
        try:
            read_omx(tmp_path / "bad.omx")
        except InputError:
            refused += 1
    assert refused > 50
