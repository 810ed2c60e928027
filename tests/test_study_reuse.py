"""What a study does not do again: reading sources, and comparing what was compared."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from study_files import STUDY, manifest, run_folder, study, write_study

from pipeline import ingest, study_comparison
from pipeline.program import versions
from pipeline.runs import sha256_of

TABLES = STUDY.replace("comparison: none", "comparison: tables").replace("seeds: 3", "seeds: 2")


@pytest.fixture
def reads(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Formats of what has been read from sources so far."""
    seen: list[str] = []
    before = ingest.read_sources

    def counted(section: Any, *rest: Any) -> Any:
        seen.append(section.format)
        return before(section, *rest)

    monkeypatch.setattr(ingest, "read_sources", counted)
    return seen


@pytest.fixture
def comparisons(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Scenarios that have been compared so far."""
    seen: list[str] = []
    before = study_comparison.compare_pairs

    def counted(pairs: Any, facts: Any) -> Any:
        seen.append(facts.scenario)
        return before(pairs, facts)

    monkeypatch.setattr(study_comparison, "compare_pairs", counted)
    return seen


def test_sources_are_read_once_a_store(tmp_path: Path, reads: list[str]) -> None:
    write_study(tmp_path)
    study(tmp_path)
    assert reads == ["tntp"]
    study(tmp_path)
    write_study(tmp_path, STUDY.replace("name: study", "name: other"))
    study(tmp_path)
    assert reads == ["tntp"]
    trips = tmp_path / "trips.tntp"
    trips.write_text(trips.read_text().replace("100.0", "50.0"))
    study(tmp_path)
    assert reads == ["tntp"] * 2
    tables = (tmp_path / "runs/other/sources").glob("*/demand.parquet")
    before = sha256_of(tmp_path / "runs/other/runs/base/seed_0/demand.parquet")
    assert [sha256_of(path) for path in tables] == [before]


def test_damaged_tables_of_sources_are_made_anew(tmp_path: Path, reads: list[str]) -> None:
    write_study(tmp_path)
    study(tmp_path)
    (kept,) = (tmp_path / "runs/study/sources").iterdir()
    content = (kept / "network/links.parquet").read_bytes()
    (kept / "network/links.parquet").write_bytes(b"damaged")  # in the store too: it is linked
    said = study(tmp_path)
    assert reads == ["tntp"] * 2
    assert any("sources: the store's entry" in line and "damaged" in line for line in said.lines)
    assert (kept / "network/links.parquet").read_bytes() == content


def test_an_unchanged_comparison_is_not_made_again(tmp_path: Path, comparisons: list[str]) -> None:
    write_study(tmp_path, TABLES)
    study(tmp_path)
    assert comparisons == ["nothing", "larger"]
    totals = tmp_path / "runs/study/comparison/totals.csv"
    before = (totals.read_bytes(), totals.stat().st_mtime_ns, manifest(tmp_path)["outputs"])
    assert "comparison: up to date" in study(tmp_path).lines
    assert comparisons == ["nothing", "larger"]
    after = (totals.read_bytes(), totals.stat().st_mtime_ns, manifest(tmp_path)["outputs"])
    assert after == before
    assert not (tmp_path / "runs/study/.earlier").exists()


def test_a_changed_comparison_is_made_again(tmp_path: Path, comparisons: list[str]) -> None:
    write_study(tmp_path, TABLES)
    study(tmp_path)
    totals = tmp_path / "runs/study/comparison/totals.csv"
    content = totals.read_bytes()
    totals.write_text("changed by hand")
    study(tmp_path)
    assert len(comparisons) == 4
    assert totals.read_bytes() == content
    write_study(tmp_path, TABLES.replace("platoon_size: 10", "platoon_size: 4"))
    study(tmp_path)
    assert len(comparisons) == 6
    assert totals.read_bytes() != content
    # and what was compared before is not believed where it is asked for again
    write_study(tmp_path, TABLES)
    study(tmp_path)
    assert len(comparisons) == 8
    assert totals.read_bytes() == content


def test_a_study_that_broke_off_keeps_its_comparison_out_of_sight(
    tmp_path: Path, comparisons: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    write_study(tmp_path, TABLES)
    study(tmp_path)
    totals = tmp_path / "runs/study/comparison/totals.csv"
    content = totals.read_bytes()

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    for _ in range(2):
        with monkeypatch.context() as broken:
            broken.setattr("pipeline.study._groups", interrupted)
            with pytest.raises(KeyboardInterrupt):
                study(tmp_path)
        assert not totals.exists()
    assert "comparison: up to date" in study(tmp_path).lines
    assert len(comparisons) == 2
    assert totals.read_bytes() == content


def test_other_libraries_make_another_comparison(
    tmp_path: Path, comparisons: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    write_study(tmp_path, TABLES)
    study(tmp_path)
    monkeypatch.setattr(study_comparison, "versions", lambda: versions() | {"scipy": "1.0"})
    study(tmp_path)
    assert len(comparisons) == 4


def test_a_worker_with_other_libraries_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_study(tmp_path, STUDY.replace("seeds: 3", "seeds: 1"))
    monkeypatch.setattr("pipeline.study_jobs.versions", lambda: versions() | {"numpy": "1.0"})
    problems = [line for line in study(tmp_path).lines if line.startswith("problem: ")]
    assert len(problems) == 3
    told = f"the worker has other versions: numpy 1.0 (the study {versions()['numpy']})"
    assert all(told in line for line in problems)
    assert not (run_folder(tmp_path, "larger", 0) / "events.parquet").exists()
