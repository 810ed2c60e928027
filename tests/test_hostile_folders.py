"""Folders and files of somebody else: nothing outside a folder is deleted, nothing hangs."""

from __future__ import annotations

import io
import json
import os
import zipfile
from pathlib import Path
from typing import Any

import pytest
from small_run import run_small, write_small_run
from study_files import STUDY, manifest, study, write_study

from pipeline.runs import FileRecord, is_unchanged
from pipeline.study_folder import StudyFolder
from uxsim_geo.engine.saved import read_saved
from uxsim_geo.errors import Faults, InputError
from uxsim_geo.network.vector_files import read_vector_file

posix = pytest.mark.skipif(os.name != "posix", reason="needs links, devices and pipes of a Unix")
OF_NOTHING = {"path": "", "sha256": "", "size": 0}


@pytest.fixture
def precious(tmp_path: Path) -> Path:
    """A file beside the results that is none of them."""
    path = tmp_path / "precious.txt"
    path.write_text("of someone else")
    return path


@pytest.fixture
def done_study(tmp_path: Path) -> Path:
    write_study(tmp_path, STUDY.replace("seeds: 3", "seeds: 1"))
    study(tmp_path)
    return tmp_path


def rewrite(path: Path, data: dict[str, Any]) -> None:
    path.write_text(json.dumps(data), encoding="utf-8")


@pytest.mark.parametrize("name", ["../../precious.txt", "{folder}/precious.txt"])
def test_the_manifest_of_a_study_cannot_have_other_files_deleted(
    done_study: Path, precious: Path, name: str
) -> None:
    told = manifest(done_study)
    told["outputs"][name.format(folder=done_study)] = OF_NOTHING
    rewrite(done_study / "runs/study/manifest.json", told)
    assert not StudyFolder(done_study / "runs/study").read_manifest().study
    study(done_study)
    assert precious.exists()


@pytest.mark.parametrize("name", ["../../precious.txt", "{folder}/precious.txt"])
def test_a_comparison_that_was_set_aside_takes_no_other_files(
    done_study: Path, precious: Path, name: str
) -> None:
    told = manifest(done_study)
    told["outputs"] = {name.format(folder=done_study): OF_NOTHING}
    aside = done_study / "runs/study/.earlier"
    aside.mkdir()
    rewrite(aside / "manifest.json", told)
    study(done_study)
    assert precious.exists()


@posix
def test_no_file_is_deleted_through_a_link_out_of_the_folder(
    finished: Path, tmp_path: Path, precious: Path
) -> None:
    (finished / "plots").symlink_to(precious.parent)
    told = json.loads((finished / "manifest.json").read_text())
    told["stages"]["report"]["outputs"]["plots/precious.txt"] = OF_NOTHING
    rewrite(finished / "manifest.json", told)
    assert run_small(tmp_path, "--set", "simulate.seed=3") == 0
    assert precious.exists()


@posix
def test_a_study_deletes_no_file_through_a_link_out_of_its_folder(
    done_study: Path, precious: Path
) -> None:
    (done_study / "runs/study/out").symlink_to(precious.parent)
    told = manifest(done_study)
    told["outputs"]["out/precious.txt"] = OF_NOTHING
    rewrite(done_study / "runs/study/manifest.json", told)
    study(done_study)
    assert precious.exists()


@posix
@pytest.mark.parametrize("what", ["device", "pipe"])
def test_what_is_no_file_is_not_read_to_its_end(tmp_path: Path, what: str) -> None:
    path = Path("/dev/zero")
    if what == "pipe":
        path = tmp_path / "pipe"
        os.mkfifo(path)
    assert not is_unchanged(FileRecord(str(path), "", path.stat().st_size), path)


def test_names_in_files_do_not_steer_a_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_small_run(tmp_path)
    (tmp_path / "od.csv").write_text("origin,destination,\x1b]0;x\x07,\u202ev\n1,2,3,4\n")
    edit = "ingest.demand=[{od: {file: od.csv}, demand_period_s: 600}]"
    assert run_small(tmp_path, "--set", edit) == 2
    shown = capsys.readouterr().err
    assert "\\x1b]0;x\\x07" in shown
    assert "\x1b" not in shown
    assert "\u202e" not in shown


SOURCE = """<OGRVRTDataSource><OGRVRTLayer name="roads"><SrcDataSource>{source}</SrcDataSource>
<SrcLayer>secret</SrcLayer><GeometryField encoding="WKT" field="wkt"/></OGRVRTLayer>
</OGRVRTDataSource>"""
PIPELINE = '{{"type": "gdal_streamed_alg", "command_line": "gdal vector pipeline ! read {source}"}}'
SERVICE = "<OGRWFSDataSource><URL>http://127.0.0.1:9/wfs</URL></OGRWFSDataSource>"


@pytest.mark.parametrize("name", ["roads.gpkg", "roads.geojson", "roads.shp", "roads.fgb"])
@pytest.mark.parametrize("text", [SOURCE, PIPELINE, SERVICE])
def test_a_file_that_sends_elsewhere_for_its_data_is_not_read(
    tmp_path: Path, name: str, text: str
) -> None:
    source = tmp_path / "secret.csv"
    source.write_text('id,wkt\n1,"LINESTRING(0 0,1 1)"\n')
    path = tmp_path / name
    path.write_text(text.format(source=source))
    faults = Faults(str(path))
    assert read_vector_file(path, None, faults) is None
    (fault,) = faults.found
    assert "holds no data that are read here" in fault.what


def test_a_saved_run_does_not_unpack_to_more_than_such_files_do(tmp_path: Path) -> None:
    path = tmp_path / "run.zip"
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        archive.writestr("state.json", json.dumps({"saved_by": "0", "sha256": {"arrays/a": ""}}))
        with archive.open("arrays/a", "w") as part:
            for _ in range(300):
                part.write(bytes(1_000_000))
    path.write_bytes(content.getvalue())
    with pytest.raises(InputError, match="unpacks to 300 MB"):
        read_saved(path)
