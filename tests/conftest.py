"""Fixtures that any test may use."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from small_run import run_small, write_small_run

# how fast examples are drawn hangs on what else the machine does, and says nothing of the code
settings.register_profile(
    "unhurried", deadline=None, suppress_health_check=[HealthCheck.too_slow], derandomize=True
)
settings.load_profile("unhurried")

REPOSITORY = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def shared() -> Path:
    """Folder of measured networks that are not part of this repository."""
    folder = Path(os.environ.get("UXSIM_GEO_SHARED", REPOSITORY.parent / "shared"))
    if not folder.is_dir():
        pytest.skip("the folder of measured networks is not here (set UXSIM_GEO_SHARED)")
    return folder


@pytest.fixture
def finished(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    """A finished run: its folder."""
    write_small_run(tmp_path)
    assert run_small(tmp_path) == 0
    capsys.readouterr()
    return tmp_path / "runs" / "small"
