"""Where downloads and compiled code lie."""

from __future__ import annotations

from pathlib import Path

import pytest

from uxsim_geo.user_cache import user_cache


@pytest.fixture(autouse=True)
def nothing_set(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("UXSIM_GEO_CACHE", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)


def test_the_programs_own_variable_goes_first(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "all"))
    assert user_cache() == tmp_path / "all" / "uxsim-geo"
    monkeypatch.setenv("UXSIM_GEO_CACHE", str(tmp_path / "own"))
    assert user_cache() == tmp_path / "own"


@pytest.mark.parametrize("relative", ["", "caches"])
def test_without_an_absolute_path_it_is_the_home(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, relative: str
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", relative)
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    assert user_cache() == tmp_path / ".cache" / "uxsim-geo"


def test_a_user_without_a_home_has_a_cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def home() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", home)
    monkeypatch.setattr("tempfile.gettempdir", lambda: str(tmp_path))
    assert user_cache() == tmp_path / ".cache" / "uxsim-geo"
