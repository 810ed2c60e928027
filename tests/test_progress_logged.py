"""What the library logs reaches whoever watches a run."""

from __future__ import annotations

import logging

import pytest

from pipeline.progress import watching

LOGGER = logging.getLogger("uxsim_geo.anything")


@pytest.mark.parametrize("quiet", [False, True])
def test_a_watch_is_told_what_is_logged(quiet: bool, capsys: pytest.CaptureFixture[str]) -> None:
    with watching(quiet=quiet):
        LOGGER.warning("compiling %s", "the engine")
    assert capsys.readouterr().err == ("" if quiet else "compiling the engine\n")


def test_afterwards_nobody_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    before = list(logging.getLogger("uxsim_geo").handlers)
    with watching(quiet=False):
        pass
    LOGGER.warning("compiling the engine")
    assert capsys.readouterr().err == ""
    assert logging.getLogger("uxsim_geo").handlers == before
