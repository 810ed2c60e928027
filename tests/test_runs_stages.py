"""What is run again and what is not, and what a run that breaks off leaves behind."""

from __future__ import annotations

import hashlib
import json
import sqlite3
from contextlib import closing
from io import StringIO
from pathlib import Path
from typing import Any

import geopandas
import pytest
from rich.console import Console
from rich.text import Text
from small_run import write_small_run

import uxsim_geo.version
from pipeline import ingest, program, report, simulate
from pipeline.config_file import load_config
from pipeline.execution import Run
from pipeline.progress import Lines, Pace, Silence, Terminal, bar_on
from pipeline.runs import RunFolder
from pipeline.stages import Stage, Task
from pipeline.verification import verify_run
from uxsim_geo.errors import InputError
from uxsim_geo.result import Progress

STAGES = (ingest.STAGE, simulate.STAGE, report.STAGE)


class Listener(Silence):
    """Remembers what was said."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def say(self, text: str) -> None:
        self.lines.append(text)


def execute(folder: Path, *edits: str, last: str = "report", force: bool = False) -> list[str]:
    """Run; return the stages that were not up to date."""
    config = load_config(folder / "small.yaml", edits)
    listener = Listener()
    run = Run(config, RunFolder(folder / "run"), listener, ["test"], STAGES)
    assert run.execute(last, force=force) == []
    return [line.partition(":")[0] for line in listener.lines if "up to date" not in line]


def contents(folder: Path) -> dict[str, bytes]:
    """The files of the run but for those that hold the time of day."""
    files = {
        path.relative_to(folder / "run").as_posix(): path.read_bytes()
        for path in (folder / "run").rglob("*")
        if path.is_file()
    }
    told = ("manifest.json", "ro-crate-metadata.json", "run.log")
    return {name: data for name, data in files.items() if name not in told}


def manifest(folder: Path) -> dict[str, Any]:
    data: dict[str, Any] = json.loads((folder / "run/manifest.json").read_text())
    return data


@pytest.fixture
def done(tmp_path: Path) -> Path:
    write_small_run(tmp_path)
    assert execute(tmp_path) == ["ingest", "simulate", "report"]
    return tmp_path


def test_who_waits_long_for_a_film_knows_it_soon() -> None:
    stream, now = StringIO(), [100.0]
    lines = Lines(stream, Pace(lambda: now[0]))
    # pictures of 2 s each, after a first one that took ten times as long
    for picture in range(1, 1001):
        now[0] += 20.0 if picture == 1 else 2.0
        lines.drawn("long.gif", picture / 1000)
    assert stream.getvalue().splitlines() == [
        "  long.gif: 0 %, about 33 min to go",  # 996 pictures, known after 6 s
        "  long.gif: 25 %, about 25 min to go",
        "  long.gif: 50 %, about 17 min to go",
        "  long.gif: 75 %, about 8 min to go",
        "  long.gif: 100 %",
    ]
    assert Pace(lambda: now[0]).to_go("a.gif", 0.5) == ""
    pace = Pace(lambda: now[0])
    pace.to_go("b.gif", 0.001)
    now[0] += 10.0
    assert pace.to_go("b.gif", 0.002) == "about 2.8 h to go"


def test_a_short_film_is_told_in_quarters_alone() -> None:
    stream, now = StringIO(), [0.0]
    lines = Lines(stream, Pace(lambda: now[0]))
    for picture in range(1, 9):
        now[0] += 1.0
        lines.drawn("short.gif", picture / 8)
    assert stream.getvalue().split() == [
        part for share in ("25", "50", "75", "100") for part in ("short.gif:", share, "%")
    ]


def test_progress_fits_a_line_of_80_columns() -> None:
    console = Console(width=80, file=StringIO(), force_terminal=True)
    bar = bar_on(console)
    task = bar.add_task("", words="")
    Terminal(bar, task).simulated(Progress(43_200.0, 86_400.0, 123_456, 234_567, 27.8))
    console.print(bar.get_renderable())
    (line,) = Text.from_ansi(console.file.getvalue()).plain.splitlines()
    assert line.startswith("43,200 of 86,400 s")
    assert line.rstrip().endswith("123,456 under way at 100 km/h, 234,567 arrived")
    assert len(line) <= 80


def test_nothing_changed_nothing_done(done: Path) -> None:
    before = {path: path.stat().st_mtime_ns for path in (done / "run").rglob("*")}
    assert execute(done) == []
    assert {path: path.stat().st_mtime_ns for path in (done / "run").rglob("*")} == before


@pytest.mark.parametrize(
    ("edit", "stages"),
    [
        ("report.bin_s=60", ["report"]),
        ("simulate.seed=3", ["simulate", "report"]),
        ("simulate.duration_s=600", ["simulate", "report"]),
        ("ingest.trips.factor=0.5", ["ingest", "simulate", "report"]),
        # read again with the same tables as the result, whose files say by which settings
        ("ingest.max_speed=39", ["ingest", "report"]),
    ],
)
def test_a_changed_key_runs_what_depends_on_it(done: Path, edit: str, stages: list[str]) -> None:
    assert execute(done, edit) == stages
    assert execute(done, edit) == []


def test_a_changed_source_runs_everything(done: Path) -> None:
    trips = done / "trips.tntp"
    trips.write_text(trips.read_text().replace("100.0", "50.0"))
    assert execute(done) == ["ingest", "simulate", "report"]
    assert json.loads((done / "run/summary.json").read_text())["vehicles_demanded"] == 50


@pytest.mark.parametrize(
    ("name", "stages"),
    [
        ("network/links.parquet", ["ingest"]),
        ("trips.parquet", ["simulate"]),
        ("results.gpkg", ["report"]),
    ],
)
def test_a_lost_or_changed_output_is_made_again(done: Path, name: str, stages: list[str]) -> None:
    before = contents(done)
    (done / "run" / name).unlink()
    assert execute(done) == stages
    (done / "run" / name).write_bytes(b"changed")
    assert execute(done) == stages
    assert contents(done).keys() == before.keys()
    # engine_wall_s alone may differ
    same = before.keys() - {"summary.json"}
    assert {key: contents(done)[key] for key in same} == {key: before[key] for key in same}


def test_force_repeats_everything_to_the_byte(done: Path) -> None:
    before = contents(done)
    assert execute(done, force=True) == ["ingest", "simulate", "report"]
    after = contents(done)
    first, second = (json.loads(files.pop("summary.json")) for files in (before, after))
    assert after == before
    assert {**first, "engine_wall_s": 0} == {**second, "engine_wall_s": 0}


def test_other_code_makes_the_results_old(done: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pipeline.execution.code_digest", lambda: "other")
    assert execute(done) == ["ingest", "simulate", "report"]


@pytest.mark.parametrize("text", ["", "{", "[]", '{"format": 0, "run": {}, "stages": {}}', "\xff"])
def test_a_damaged_manifest_is_not_believed(done: Path, text: str) -> None:
    (done / "run/manifest.json").write_text(text, encoding="latin-1")
    assert execute(done) == ["ingest", "simulate", "report"]


@pytest.mark.parametrize("name", ["../precious.txt", "{folder}/precious.txt"])
def test_a_manifest_cannot_have_other_files_deleted(done: Path, name: str) -> None:
    precious = done / "precious.txt"
    precious.write_text("of someone else")
    data = manifest(done)
    data["stages"]["report"]["outputs"][name.format(folder=done)] = {
        "path": name,
        "sha256": "",
        "size": 0,
    }
    (done / "run/manifest.json").write_text(json.dumps(data))
    assert execute(done, "simulate.seed=3", last="simulate") == ["ingest", "simulate"]
    assert precious.exists()


def test_manifest_vouches_for_every_file(done: Path) -> None:
    data = manifest(done)
    outputs = [stage["outputs"] for stage in data["stages"].values()]
    recorded = {name: record["sha256"] for stage in outputs for name, record in stage.items()}
    recorded["config.yaml"] = data["run"]["config_file"]["sha256"]
    found = {name: hashlib.sha256(bytes_).hexdigest() for name, bytes_ in contents(done).items()}
    assert recorded == found
    sources = data["stages"]["ingest"]["inputs"]
    assert sorted(sources) == ["net", "nodes", "trips.0.file"]
    net = (done / "net.tntp").read_bytes()
    digest = hashlib.sha256(net).hexdigest()
    assert sources["net"] == {"path": "../net.tntp", "sha256": digest, "size": len(net)}


def test_resolved_configuration_repeats_the_run(done: Path) -> None:
    config = load_config(done / "run/config.yaml")
    run = Run(config, RunFolder(done / "run"), Listener(), ["test"], STAGES)
    assert all(run.is_current(stage) for stage in STAGES)


def test_a_new_simulation_takes_the_old_report_away(done: Path) -> None:
    assert execute(done, "simulate.seed=3", last="simulate") == ["simulate"]
    assert not (done / "run/results.gpkg").exists()
    assert not (done / "run/summary.json").exists()
    assert verify_run(done / "run").wrong == []


def test_an_output_no_longer_wanted_goes(done: Path) -> None:
    assert execute(done, "report.outputs=[]") == ["report"]
    assert not (done / "run/results.gpkg").exists()
    assert (done / "run/summary.json").exists()


def test_a_network_that_is_refused_leaves_its_tables_and_no_older_results(done: Path) -> None:
    net = done / "net.tntp"
    # a capacity of 1 on every link stands for none, so the tables have no lanes
    net.write_text(net.read_text().replace(" 1800 ", " 1 "))
    with pytest.raises(InputError, match="lanes"):
        execute(done)
    assert {name.partition("/")[0] for name in contents(done)} == {
        "config.yaml",
        "demand.parquet",
        "demand_notes.parquet",
        "import_notes.html",
        "network",
    }
    assert verify_run(done / "run").wrong == []


def test_a_killed_run_is_never_believed(done: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def cut_off(table: object, path: Path) -> None:  # noqa: ARG001
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("uxsim_geo.network.files.write_table", cut_off)
        with pytest.raises(KeyboardInterrupt):
            execute(done, force=True)
    assert "was not finished" in manifest(done)["stages"]["ingest"]["problems"][0]
    assert verify_run(done / "run").wrong == ["ingest: was not finished; run it again"]
    assert not [path for path in (done / "run").rglob("*") if ".part" in path.name]
    assert execute(done)[0] == "ingest"


def test_a_picture_that_cannot_be_drawn_is_a_problem_and_the_rest_is_written(
    done: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from uxsim_geo.export.space_time import drawing

    def fail(*_: object) -> None:
        raise drawing.RenderError("no library to draw with")

    monkeypatch.setattr(drawing, "write_still", fail)
    config = load_config(done / "small.yaml", ["report.outputs=[space_time, geopackage]"])
    run = Run(config, RunFolder(done / "run"), Listener(), ["test"], STAGES)
    assert run.execute("report") == ["space_time.png could not be written: no library to draw with"]
    assert (done / "run/results.gpkg").exists()
    assert (done / "run/space_time.html").exists()
    assert not run.is_current(report.STAGE)
    assert verify_run(done / "run").wrong == [
        "report: space_time.png could not be written: no library to draw with"
    ]


@pytest.mark.parametrize("stage", STAGES, ids=lambda stage: stage.name)
def test_a_stage_announces_its_writing_before_it_does(done: Path, stage: Stage) -> None:
    config = load_config(done / "small.yaml", ["report.bin_s=60", "simulate.duration_s=30"])
    folder = RunFolder(done / "run")
    figures = {name: record.figures for name, record in folder.read_manifest().stages.items()}
    before, seen = contents(done), []
    stage.run(Task(config, folder, figures, Silence(), lambda: seen.append(contents(done))))
    # what a run writes while it goes on has a temporary name
    finished = {name: data for name, data in seen[0].items() if not name.startswith(".")}
    assert finished == before
    assert len(seen) == 1


def test_tables_and_templates_of_the_program_are_code() -> None:
    packages = (Path(program.__file__).parent, Path(uxsim_geo.version.__file__).parent)
    files = {path for package in packages for path in package.rglob("*") if path.is_file()}
    others = {path.suffix for path in files} - set(program.SOURCES) - {".pyc", ".nbi", ".nbc"}
    assert {path.name for path in files if path.suffix in others} <= {"py.typed"}


def test_the_page_of_the_import_is_an_output_of_the_first_stage(done: Path) -> None:
    outputs = RunFolder(done / "run").read_manifest().stages["ingest"].outputs
    assert "import_notes.html" in outputs
    before = (done / "run/import_notes.html").read_bytes()
    execute(done, force=True)
    assert (done / "run/import_notes.html").read_bytes() == before


def test_layers_go_to_files_of_their_own_on_demand(done: Path) -> None:
    wanted = ["report.outputs=[geoparquet, flatgeobuf]", "report.layers=[od_lines, trajectories]"]
    assert execute(done, *wanted, "report.trajectories.trips=3") == ["report"]
    layers = {path.name for path in (done / "run/layers").iterdir()}
    spatial = {"nodes", "links", "od_lines", "trajectories"}
    assert layers == {f"{name}.fgb" for name in spatial} | {
        f"{name}.parquet" for name in (*spatial, "run_info")
    }
    assert len(geopandas.read_parquet(done / "run/layers/trajectories.parquet")) == 3
    assert not (done / "run/results.gpkg").exists()
    assert verify_run(done / "run").wrong == []


def test_results_say_what_they_were_made_of_and_whose_it_is(done: Path) -> None:
    told = ["report.attribution=Stadt <Ähm>", "report.driving_side=left"]
    assert execute(done, *told) == ["report"]
    with closing(sqlite3.connect(done / "run/results.gpkg")) as database:
        items, provenance = (
            text for (text,) in database.execute("SELECT metadata FROM gpkg_metadata ORDER BY id")
        )
        styles = database.execute(
            "SELECT styleQML FROM layer_styles WHERE f_table_name = 'links'"
            " AND styleName <> 'roads'"  # grey, below other layers: on no side
        ).fetchall()
    assert all('value="-(0.15 + ' in style for (style,) in styles)
    assert 'key="attribution">Stadt &lt;Ähm&gt;<' in items
    made = json.loads(provenance)
    recorded = manifest(done)["stages"]["ingest"]["inputs"]
    assert made["sources"] == {
        name: {"file": f"{name.partition('.')[0]}.tntp", "sha256": recorded[name]["sha256"]}
        for name in ("net", "nodes", "trips.0.file")
    }
    assert made["settings"]["simulate"]["duration_s"] == 1200
    assert str(done) not in provenance
