"""Configurations: what is accepted, and how every fault is said."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from conftest import REPOSITORY
from small_run import CONFIG, write_small_run

from pipeline.config import Config, ReportSection, SimulateSection
from pipeline.config_file import config_of, iterate_keys, load_config, write_config
from pipeline.ingest_config import IngestSection, TripsEntry
from pipeline.study_config import read_study
from uxsim_geo.demand.profile import TripsOptions
from uxsim_geo.errors import InputError
from uxsim_geo.network.tntp_options import TntpOptions
from uxsim_geo.settings import Settings


def faults_of(folder: Path, config: str, *edits: str) -> list[str]:
    path = write_small_run(folder, config)
    with pytest.raises(InputError) as caught:
        load_config(path, edits)
    return [str(fault).replace(str(path), "small.yaml") for fault in caught.value.faults]


def only_fault(folder: Path, config: str, *edits: str) -> str:
    (fault,) = faults_of(folder, config, *edits)
    return fault


def test_defaults_are_those_of_the_library(tmp_path: Path) -> None:
    config = load_config(write_small_run(tmp_path))
    assert config.simulate.settings() == Settings(duration=1200.0)
    assert config.ingest.trips[0].trips_options() == TripsOptions(period_s=600.0)
    stated = {"crs": "none", "length_unit": "m", "time_unit": "s", "capacity_unit": "veh/h"}
    assert config.ingest.network_options() == TntpOptions(**stated)


def test_every_key_has_help() -> None:
    assert [name for name, key in iterate_keys() if not key.description] == []


def test_unknown_key_names_the_nearest_one_and_its_line(tmp_path: Path) -> None:
    fault = only_fault(tmp_path, CONFIG.replace("time_unit", "tme_unit"))
    assert fault == "small.yaml:10: unknown key ingest.tme_unit; did you mean ingest.time_unit?"


def test_key_in_the_wrong_section_is_sent_to_the_right_one(tmp_path: Path) -> None:
    fault = only_fault(tmp_path, CONFIG + "  platoon_size: 5\n")
    assert fault == (
        "small.yaml:17: unknown key report.platoon_size; did you mean simulate.platoon_size?"
    )


def test_keys_of_a_section_that_may_be_false_are_told_as_any(tmp_path: Path) -> None:
    fault = only_fault(tmp_path, CONFIG, "ingest.ready.ring_storage_vehs=5")
    assert fault.endswith(
        "unknown key ingest.ready.ring_storage_vehs; did you mean ingest.ready.ring_storage_veh?"
    )
    assert "ingest.ready.ring_storage_veh: must be" in only_fault(
        tmp_path, CONFIG, "ingest.ready.ring_storage_veh=-3"
    )


def test_a_key_alike_in_its_own_section_goes_before_one_elsewhere(tmp_path: Path) -> None:
    fault = only_fault(tmp_path, CONFIG, "report.space_time.form=[png]")
    assert fault.endswith("did you mean report.space_time.forms?")
    assert "report.space_time.forms" in only_fault(tmp_path, CONFIG, "report.space_time.forms=[]")


def test_key_like_no_other_gets_the_list_of_known_ones(tmp_path: Path) -> None:
    fault = only_fault(tmp_path, CONFIG + "  zzzzzz: 5\n")
    assert "known here: bin_s, start, outputs" in fault


def test_all_faults_come_at_once_in_the_order_of_the_file(tmp_path: Path) -> None:
    config = (
        CONFIG.replace("net: net.tntp", "net: nowhere.tntp")
        .replace("demand_period_s: 600", "demand_period_s: long")
        .replace("duration_s: 1200", "duration_s: -1")
        .replace("length_unit: m", "length_unit: furlong")
    )
    faults = faults_of(tmp_path, config)
    assert [fault.split(":")[1] for fault in faults] == ["3", "7", "9", "13"]
    assert "no such file" in faults[0]
    assert "ingest.trips.demand_period_s: must be a valid number" in faults[1]
    assert "found 'long'" in faults[1]
    assert "is not a unit of length: write one of m, km, ft, mi" in faults[2]
    assert "simulate.duration_s: must be greater than 0" in faults[3]


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        ("duration_s: 1200\n  platoon_size: 2.5", "simulate.platoon_size: must be a valid integer"),
        ("duration_s: true", "simulate.duration_s: must be a valid number"),
        ("duration_s: .nan", "simulate.duration_s: must be a finite number"),
        ("duration_s: .inf", "simulate.duration_s: must be a finite number"),
        ("duration_s: 1200\n  demand_rounding: up", "must be 'conserve' or 'truncate'"),
        ("platoon_size: 5", "simulate.duration_s is missing (end of the simulation"),
        ("duration_s: 1200\n  duration_s: 5", "the key is given twice, first in line 13"),
        ("duration_s: [1, 2", "is not YAML"),
        ("duration_s: !!python/name:os.system x", "tags are not understood here"),
    ],
)
def test_wrong_value(tmp_path: Path, written: str, expected: str) -> None:
    assert expected in only_fault(tmp_path, CONFIG.replace("duration_s: 1200", written))


def test_alias_is_refused_even_if_it_holds_itself(tmp_path: Path) -> None:
    assert "aliases" in only_fault(tmp_path, "name: &a [*a]\n")


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"", "is empty"),
        (b"# only a remark\n", "holds no key"),
        (b"- a\n- b\n", "must hold lines of the form"),
        (b"\x00\x01\x02", "binary"),
        (b"name: \xff\xfe", "UTF-8"),
        (b"[" * 3000, "nested too deeply"),
    ],
)
def test_file_that_is_no_configuration(tmp_path: Path, content: bytes, expected: str) -> None:
    path = tmp_path / "small.yaml"
    path.write_bytes(content)
    with pytest.raises(InputError, match=expected) as caught:
        load_config(path)
    assert len(caught.value.faults) == 1


def test_plain_words_and_numbers_mean_what_yaml_1_2_says(tmp_path: Path) -> None:
    config = CONFIG.replace("name: small", "name: no").replace("1200", "1.2e3")
    loaded = load_config(write_small_run(tmp_path, config))
    assert loaded.name == "no"
    assert loaded.simulate.duration_s == 1200.0


def test_edits_take_the_place_of_the_file(tmp_path: Path) -> None:
    path = write_small_run(tmp_path)
    edits = ["simulate.duration_s=60", "ingest.trips.factor=2", "report.bin_s=30", "name=other"]
    config = load_config(path, edits)
    assert config.simulate.duration_s == 60.0
    assert config.ingest.trips[0].factor == 2.0
    assert config.report.bin_s == 30.0
    assert config.name == "other"


def test_edit_reaches_into_a_list(tmp_path: Path) -> None:
    entry = "  trips:\n    - file: trips.tntp\n      demand_period_s: 600\n"
    config = CONFIG.replace("  trips:\n    file: trips.tntp\n    demand_period_s: 600\n", entry)
    path = write_small_run(tmp_path, config)
    assert load_config(path, ["ingest.trips.0.factor=3"]).ingest.trips[0].factor == 3.0
    for key in ("1.factor", "factor"):
        with pytest.raises(InputError, match=r"counted from 0: write ingest\.trips\.0\.factor"):
            load_config(path, [f"ingest.trips.{key}=3"])


def test_edit_counts_a_single_entry_as_a_list_of_one(tmp_path: Path) -> None:
    path = write_small_run(tmp_path)
    edits = ["ingest.trips.0.factor=3", "ingest.trips.0.profile=[[600, 1]]"]
    (entry,) = load_config(path, edits).ingest.trips
    assert (entry.factor, entry.profile) == (3.0, ((600.0, 1.0),))
    whole = "ingest.trips.0={file: trips.tntp, demand_period_s: 60}"
    assert load_config(path, [whole]).ingest.trips[0].demand_period_s == 60.0
    with pytest.raises(InputError, match=r"counted from 0: write ingest\.trips\.0\.factor"):
        load_config(path, ["ingest.trips.1.factor=3"])


@pytest.mark.parametrize(
    ("edit", "expected"),
    [
        ("simulate.duration_s", "must have the form key.sub=value"),
        ("=3", "must have the form key.sub=value"),
        ("name.sub=3", "name is a single value"),
        ("simulate.duration_s=soon", "simulate.duration_s: must be a valid number"),
        ("simulate=5", "simulate: must be a section (keys and values)"),
        ("ingest.net=3", "ingest.net: must be the path of a file"),
        ("report.outputs=mfd", "report.outputs: must be a list, as [a, b]"),
        ("simulate.seeed=3", "did you mean simulate.seed?"),
        ("ingest.trips.profile=[[600]]", "ingest.trips.profile[0][1]: a value is missing"),
        ("report.start=0001-01-01T00:00:00+02:00", "must lie in the years 1 to 9999"),
        ("simulate.duration_s=[1", "is not YAML"),
    ],
)
def test_wrong_edit_is_named(tmp_path: Path, edit: str, expected: str) -> None:
    fault = only_fault(tmp_path, CONFIG, edit)
    assert fault.startswith(f"--set {edit}")
    assert expected in fault


def test_resolved_configuration_runs_from_where_it_lies(tmp_path: Path) -> None:
    config = load_config(write_small_run(tmp_path), ["ingest.trips.profile=[[300, 2], [600, 1]]"])
    resolved = tmp_path / "elsewhere" / "config.yaml"
    resolved.parent.mkdir()
    write_config(config, resolved)
    assert load_config(resolved) == config
    written = yaml.safe_load(resolved.read_text())
    sections = (Config, IngestSection, SimulateSection, ReportSection, TripsEntry)
    mappings = (written, *(written[name] for name in ("ingest", "simulate", "report")))
    for section, mapping in zip(sections, (*mappings, written["ingest"]["trips"][0]), strict=True):
        assert list(mapping) == [key.alias or name for name, key in section.model_fields.items()]


def test_start_keeps_its_instant_and_its_zone_and_needs_one(tmp_path: Path) -> None:
    config = load_config(write_small_run(tmp_path), ["report.start=2024-05-01T07:00:00+02:00"])
    assert config.report.start.isoformat() == "2024-05-01T07:00:00+02:00"
    write_config(config, tmp_path / "resolved.yaml")
    assert load_config(tmp_path / "resolved.yaml").report.start.isoformat() == (
        "2024-05-01T07:00:00+02:00"
    )
    assert "must name its zone" in only_fault(tmp_path, CONFIG, "report.start=2024-05-01T07:00:00")


@pytest.mark.parametrize("name", ["../up", "a/b", "", ".hidden"])
def test_name_must_be_fit_for_a_folder(tmp_path: Path, name: str) -> None:
    assert "name: must not be empty, hold" in only_fault(tmp_path, CONFIG, f"name='{name}'")


OWN = sorted((REPOSITORY / "configs").glob("*.yaml"))
STUDIES = [path for path in OWN if path.stem.startswith("study_")]


@pytest.mark.parametrize("path", sorted({*OWN} - {*STUDIES}), ids=str)
def test_own_configurations_are_valid(path: Path) -> None:
    assert load_config(path).name == path.stem


@pytest.mark.parametrize("path", STUDIES, ids=str)
def test_own_studies_are_valid_and_so_are_their_bases(path: Path) -> None:
    study = read_study(path)
    assert study.config.name == path.stem
    assert config_of(study.base_copy()).name == study.config.base.stem


def test_pages_made_from_the_code_are_in_step_with_it() -> None:
    code = (
        "import json, runpy; made = runpy.run_path('docs/generate.py');"
        "read = lambda name: open('docs/' + name, encoding='utf-8').read();"
        "pages = {name: made['results_page'](read(name), layers)"
        " for name, layers in made['PAGES'].items()};"
        "names = ('configuration_page', 'configuration_schema', 'study_page', 'study_schema');"
        "print(json.dumps([*(made[name]() for name in names), pages]))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=REPOSITORY, check=True, capture_output=True, text=True
    )
    page, schema, study_page, study_schema, pages = json.loads(done.stdout)
    docs = REPOSITORY / "docs"
    assert page == (docs / "config.md").read_text(encoding="utf-8")
    assert schema == (docs / "config.schema.json").read_text(encoding="utf-8")
    assert study_page == (docs / "study_keys.md").read_text(encoding="utf-8")
    assert study_schema == (docs / "study.schema.json").read_text(encoding="utf-8")
    assert set(pages) == {"results.md", "studies_results.md"}
    for name, text in pages.items():
        assert text == (docs / name).read_text(encoding="utf-8")
