"""The doors by which files of others come in, as functions that read what lies in a folder.

A door either returns or raises the user's error, :class:`uxsim_geo.errors.InputError`; anything
else is a defect of the program, whatever the files hold.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

# the helpers of the tests, also where this is no test
sys.path[:0] = [str(Path(__file__).resolve().parents[level]) for level in (0, 1)]

from parts import parts_of, write_parts  # noqa: E402

if TYPE_CHECKING:
    from pipeline.config import Config
    from uxsim_geo.demand.demand import Demand
    from uxsim_geo.network.network import Network

CORPUS = Path(__file__).parent / "corpus"


@dataclass(frozen=True)
class Door:
    """A way in.

    read
        what reads the files in a folder
    main
        the file that a case is, if it does not say which
    names
        of all files that a case may hold; those it does not hold are as in the case ``good``
    prepare
        makes what else must lie in the folder, once
    """

    read: Callable[[Path], object]
    main: str
    names: tuple[str, ...] = ()
    prepare: Callable[[Path], object] | None = None

    def parts(self, data: bytes) -> dict[str, bytes]:
        """The files of a case."""
        return parts_of(data, self.names, self.main)


@dataclass
class Opened:
    """A door with a folder of its own, in which one case after the other is read."""

    name: str
    folder: Path

    def __post_init__(self) -> None:
        self.door = DOORS[self.name]
        if self.door.prepare is not None:
            self.door.prepare(self.folder)
        cases = list((CORPUS / self.name).glob("good.*")) or [self.folder / self.door.main]
        self.good = self.door.parts(cases[0].read_bytes())
        write_parts(self.folder, self.good)

    def read(self, data: bytes) -> object:
        """Read a case; afterwards the folder is as it was."""
        parts = self.door.parts(data)
        write_parts(self.folder, parts)
        try:
            return self.door.read(self.folder)
        finally:
            for name in parts:
                if name in self.good:
                    (self.folder / name).write_bytes(self.good[name])
                else:
                    (self.folder / name).unlink(missing_ok=True)


def _small_network() -> tuple[Network, Demand]:
    import tempfile

    from small_run import write_small_run

    from pipeline.config_file import load_config
    from pipeline.ingest import read_sources

    with tempfile.TemporaryDirectory() as folder:
        return read_sources(load_config(write_small_run(Path(folder))).ingest)


#: of the configuration ``small``
small_network = cache(_small_network)


def _config(folder: Path) -> object:
    """A configuration with its control file, its edits made and its measures set up."""
    from pipeline.config_file import load_config

    return _set_up(load_config(folder / "config.yaml"))


def _set_up(config: Config) -> object:
    from pipeline.control_words import changes_of
    from pipeline.edits import apply_edits, placed_edits
    from uxsim_geo.engine.setting import set_up

    edited = apply_edits(*small_network(), placed_edits(config))
    section = config.simulate
    control = [entry.measure() for _, _, entry in section.control.entries()]
    classes = [entry.driver_class() for entry in section.classes]
    set_up(edited.network, edited.demand, section.settings(), control, classes)
    return changes_of(config, edited.network)


def _write_small_run(folder: Path) -> object:
    from small_run import write_small_run

    return write_small_run(folder)


def _study(folder: Path) -> object:
    """A study with its base, its scenarios resolved."""
    from pipeline.scenarios import Tables, read_scenarios, resolve
    from pipeline.study_config import read_study

    study = read_study(folder / "study.yaml")
    scenarios = read_scenarios(study.reading)
    tables = Tables(*small_network())
    return resolve(study.base_copy(), study.reading, scenarios, tables)


@cache
def _read_once(path: Path, content: bytes) -> Config:  # noqa: ARG001  what is read once
    from pipeline.config_file import load_config

    return load_config(path)


def _sources(folder: Path) -> object:
    """Network, demand and signals as the configuration of the door says it."""
    from pipeline.ingest import read_sources
    from pipeline.signal_tables import signal_table

    path = folder / "config.yaml"
    config = _read_once(path, path.read_bytes())
    network, demand = read_sources(config.ingest)
    from pipeline.edits import apply_edits
    from uxsim_geo.network.notes import Notes

    return signal_table(config.ingest, network, apply_edits(network, demand, []), Notes())


def _osm_config(folder: Path, ending: str) -> object:
    """What reads a map of another format as that of the door ``osm_xml`` is read."""
    good = parts_of((CORPUS / "osm_xml/good.txt").read_bytes(), _OSM, "map.osm")
    config = good["config.yaml"].replace(b"map.osm", f"map.osm{ending}".encode())
    return write_parts(folder, {"od.csv": good["od.csv"], "config.yaml": config})


def _tables(folder: Path) -> object:
    """All tables that go with a network."""
    from uxsim_geo.demand.access_file import read_access
    from uxsim_geo.demand.balance import read_totals
    from uxsim_geo.demand.profile_file import read_profiles

    def access(path: Path) -> object:
        return read_access(path, small_network()[0])

    return _all_of(
        (lambda _path: _sources(folder), folder),
        (read_profiles, folder / "profile.csv"),
        (access, folder / "access.csv"),
        (read_totals, folder / "totals.csv"),
    )


def _overpass(folder: Path) -> object:
    """An answer of the server, written as a file of the cache and read from there."""
    from uxsim_geo.errors import Faults
    from uxsim_geo.network.osm import read_osm_network
    from uxsim_geo.network.osm_answer import read_answer, write_osm_xml
    from uxsim_geo.network.osm_options import OsmOptions

    faults = Faults("answer")
    answer = read_answer((folder / "answer.json").read_bytes(), faults)
    faults.raise_if_any()
    assert answer is not None, "an answer that cannot be read is a fault"
    write_osm_xml(answer, folder / "answer.osm.gz")
    return read_osm_network(folder / "answer.osm.gz", OsmOptions())


def _counts(folder: Path) -> object:
    from uxsim_geo.analysis.observations import read_counts, read_travel_times

    return read_counts(folder / "counts.csv"), read_travel_times(folder / "times.csv")


def _parquet(folder: Path) -> object:
    """A Parquet file as OD table, as lines and as a table to be shown."""
    return _all_of(
        (_od_table, folder / "table.parquet"),
        (_vector, folder / "table.parquet"),
        (_inspected, folder / "table.parquet"),
    )


def _od_table(path: Path) -> object:
    from uxsim_geo.demand.od_files import read_od

    return read_od(path)


def _vector(path: Path) -> object:
    """Lines as a network, and areas as zones and as a polygon."""
    return _all_of((_mapped, path), (_zones, path), (_area, path))


def _mapped(path: Path) -> object:
    from uxsim_geo.network.mapped import read_mapped_network
    from uxsim_geo.network.mapped_options import ColumnMapping, Source

    columns = {
        "link_id": "key",
        "free_speed": Source("vmax", unit="km/h", missing=50),
        "lanes": Source("lanes", missing=1),
    }
    return read_mapped_network(path, ColumnMapping(columns))


def _zones(path: Path) -> object:
    from uxsim_geo.demand.zones import read_zones

    return read_zones(path, "key")


def _area(path: Path) -> object:
    from uxsim_geo.errors import Faults
    from uxsim_geo.network.selection import read_area

    faults = Faults(str(path))
    read_area(str(path), "EPSG:25832", faults)
    return faults.raise_if_any()


def _inspected(path: Path) -> object:
    from pipeline.inspection import inspect_path

    return inspect_path(path)


def _geopackage(folder: Path) -> object:
    from uxsim_geo.network.overrides import apply_overrides

    path = folder / "roads.gpkg"

    def overridden(path: Path) -> object:
        return apply_overrides(small_network()[0], path)

    return _all_of((_vector, path), (_inspected, path), (overridden, path))


def _omx(folder: Path) -> object:
    from uxsim_geo.demand.omx import read_omx

    return read_omx(folder / "od.omx")


def _save_a_run(folder: Path) -> None:
    """Save a run half-way: what is in the file changes with the engine."""
    from small_networks import demand, link, network

    from uxsim_geo.engine.simulation import Simulation
    from uxsim_geo.settings import Settings

    roads = network([link("0", "a", "b", 100.0), link("1", "b", "c", 100.0)])
    run = Simulation(roads, demand(("a", "c", 0.0, 60.0, 20)), Settings(100.0))
    run.advance(50.0)
    run.save(folder / "saved.zip")


def _saved(folder: Path) -> object:
    from uxsim_geo.engine.simulation import Simulation

    return Simulation.resume(folder / "saved.zip")


def _all_of(*readers: tuple[Callable[[Path], object], Path]) -> object:
    """Call every reader; a fault in one leaves the others to be called."""
    from uxsim_geo.errors import InputError

    faults = []
    for read, path in readers:
        try:
            read(path)
        except InputError as error:
            faults += error.faults
    if faults:
        raise InputError(faults)
    return None


def _command(*arguments: str) -> object:
    """What a command does, without the last net that the command line spreads."""
    from pipeline.cli import _parser

    options = _parser().parse_args(arguments)
    options.arguments, options.folder = list(arguments), None
    return options.command(options)


def _finished_run(folder: Path) -> object:
    import shutil

    from small_run import run_small, write_small_run

    write_small_run(folder)
    assert run_small(folder, "--quiet") == 0
    (folder / "again/small").mkdir(parents=True)
    return shutil.copytree(folder / "runs/small", folder / "runs/other")


def _manifest(folder: Path) -> object:
    """What is done with a run, by its manifest; it is not simulated again."""
    run, other = folder / "runs/small", folder / "runs/other"

    def repeated(path: Path) -> object:
        from pipeline.progress import Silence
        from pipeline.repeating import Repeat, repeat_run
        from pipeline.stages import Outcome, Stage

        stages = tuple(
            Stage(name, (name,), lambda _config, _folder: {}, lambda _task: Outcome((), "done"))
            for name in ("ingest", "simulate", "report")
        )
        return repeat_run(Repeat(path / "manifest.json", folder / "again", Silence(), stages))

    def called(*arguments: str) -> tuple[Callable[[Path], object], Path]:
        return (lambda _path: _command(*arguments)), run

    return _all_of(
        (repeated, run),
        called("verify", str(run)),
        called("inspect", str(run)),
        called("compare", str(other), str(run), "--tables-alone", "--out", str(folder / "diff")),
        called("export", str(run), "--table", "trips", "--out", str(folder / "trips.csv")),
    )


def _finished_study(folder: Path) -> object:
    from study_files import study, write_study

    write_study(folder)
    return study(folder)


def _study_manifest(folder: Path) -> object:
    """What is done with a study, by its manifest; it is not simulated again."""
    from pipeline.study_manifest import study_from

    root = folder / "runs/study"

    def called(*arguments: str) -> tuple[Callable[[Path], object], Path]:
        return (lambda _path: _command(*arguments)), root

    return _all_of(
        (study_from, root / "manifest.json"),
        called("verify", str(root)),
        called("inspect", str(root)),
        called("clean", "--out", str(folder / "runs")),
    )


def _words(folder: Path) -> object:
    """Lines ``KIND TEXT`` of what is written in single keys and on the command line."""
    text = (folder / "words.txt").read_bytes().decode("utf-8", errors="replace")
    lines = [line.partition(" ") for line in text.splitlines()[:20]]
    readers = _word_readers()
    told = [(readers[kind], Path(word)) for kind, _, word in lines if kind in readers]
    return _all_of(*told)


@cache
def _word_readers() -> dict[str, Callable[[Path], object]]:
    from pipeline.yaml_source import YamlSource, set_value
    from uxsim_geo.control.site import Target
    from uxsim_geo.errors import Faults
    from uxsim_geo.network.measure import parse_crs
    from uxsim_geo.network.osm_query import read_area_in_degrees
    from uxsim_geo.network.selection import select_links

    def chosen(word: Path) -> object:
        return select_links(small_network()[0], Target(where=str(word)))

    def polygon(word: Path) -> object:
        return select_links(small_network()[0], Target(polygon=f"POLYGON{word}"))

    def with_faults(read: Callable[[str, Faults], object]) -> Callable[[Path], object]:
        def call(word: Path) -> object:
            faults = Faults("words")
            read(str(word), faults)
            return faults.raise_if_any()

        return call

    def assigned(word: Path) -> object:
        document = YamlSource("words", {"name": "small", "list": [1, {"a": 2}], "text": "x"})
        return set_value(document, str(word), ["list"])

    def area(word: str, faults: Faults) -> object:
        return read_area_in_degrees(f"POLYGON{word}", faults)

    return {
        "where": chosen,
        "polygon": polygon,
        "area": with_faults(area),
        "crs": with_faults(parse_crs),
        "set": assigned,
    }


_OSM = ("map.osm", "od.csv", "config.yaml")
_TNTP = ("net.tntp", "nodes.tntp", "trips.tntp", "flow.tntp", "points.geojson", "config.yaml")
_GMNS = tuple(
    f"{name}.csv"
    for name in (
        *("node", "link", "geometry", "lane", "movement", "demand", "config", "zone"),
        *("signal_controller", "signal_coordination", "signal_phase_mvmt", "signal_timing_phase"),
        *("signal_timing_plan", "segment"),
    )
)
_TABLES = (
    *("over.csv", "signals.csv", "od.csv", "matrix.csv", "list.csv", "profile.csv"),
    *("access.csv", "totals.csv", "zones.geojson"),
)

#: by name
DOORS: dict[str, Door] = {
    "config": Door(_config, "config.yaml", ("config.yaml", "control.yaml"), _write_small_run),
    "study": Door(_study, "study.yaml", ("study.yaml", "small.yaml"), _write_small_run),
    "tntp": Door(_sources, "net.tntp", _TNTP),
    "tntp_points": Door(_sources, "points.geojson", _TNTP),
    "osm_xml": Door(_sources, "map.osm", _OSM),
    "osm_pbf": Door(_sources, "map.osm.pbf", prepare=lambda folder: _osm_config(folder, ".pbf")),
    "osm_gz": Door(_sources, "map.osm.gz", prepare=lambda folder: _osm_config(folder, ".gz")),
    "osm_bz2": Door(_sources, "map.osm.bz2", prepare=lambda folder: _osm_config(folder, ".bz2")),
    "overpass": Door(_overpass, "answer.json"),
    "gmns": Door(_sources, "link.csv", (*_GMNS, "config.yaml")),
    "uxsim": Door(_sources, "links.csv", ("nodes.csv", "links.csv", "demand.csv", "config.yaml")),
    "tables": Door(_tables, "over.csv", (*_TABLES, "config.yaml"), _write_small_run),
    "counts": Door(_counts, "counts.csv", ("counts.csv", "times.csv")),
    "parquet": Door(_parquet, "table.parquet"),
    "geopackage": Door(_geopackage, "roads.gpkg"),
    "geojson": Door(lambda folder: _vector(folder / "roads.geojson"), "roads.geojson"),
    "flatgeobuf": Door(lambda folder: _vector(folder / "roads.fgb"), "roads.fgb"),
    "omx": Door(_omx, "od.omx"),
    "saved": Door(_saved, "saved.zip", prepare=_save_a_run),
    "manifest": Door(_manifest, "runs/small/manifest.json", (), _finished_run),
    "study_manifest": Door(_study_manifest, "runs/study/manifest.json", (), _finished_study),
    "words": Door(_words, "words.txt"),
}

#: doors at which a file is read as several things, of which it is only one
READ_IN_SEVERAL_WAYS = ("parquet", "geopackage", "geojson", "flatgeobuf")
