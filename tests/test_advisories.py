"""The step that asks for advisories: it fails on findings alone, and tells what it did not ask."""

from __future__ import annotations

import importlib.util
from types import ModuleType
from typing import Any

import pytest
from conftest import REPOSITORY

UNKNOWN = {"name": "other", "skip_reason": "not found"}
SOUND = {"name": "sound", "version": "2.0", "vulns": []}
FAULTY = {
    "name": "faulty",
    "version": "1.0",
    "vulns": [{"id": "PYSEC-1", "fix_versions": ["1.1"]}, {"id": "PYSEC-2", "fix_versions": []}],
}


@pytest.fixture
def advisories() -> ModuleType:
    script = REPOSITORY / ".ci/advisories.py"
    if not script.is_file():
        pytest.skip("the steps of the repository are not here")
    told = importlib.util.spec_from_file_location("advisories", script)
    assert told is not None
    assert told.loader is not None
    module = importlib.util.module_from_spec(told)
    told.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("packages", "status", "words"),
    [
        (None, 0, "NOT CHECKED"),
        ([UNKNOWN], 0, "NOT CHECKED"),
        ([SOUND, UNKNOWN], 0, "1 of 2 packages"),
        ([SOUND, FAULTY], 1, "faulty 1.0: PYSEC-1, mended in 1.1"),
        ([SOUND, FAULTY], 1, "faulty 1.0: PYSEC-2, mended in no version yet"),
    ],
)
def test_findings_alone_fail(
    advisories: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    packages: list[dict[str, Any]] | None,
    status: int,
    words: str,
) -> None:
    monkeypatch.setattr(advisories, "asked", lambda _lock: packages)
    assert advisories.main(["a.lock"]) == status
    assert words in capsys.readouterr().out
