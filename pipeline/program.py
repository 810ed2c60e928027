"""What results are made by: the program's own source, libraries, and the machine."""

from __future__ import annotations

import hashlib
import os
import platform
from collections.abc import Iterator
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

import uxsim_geo.version
from pipeline.examples import INSTALLED
from pipeline.runs import StageRecord

#: distributions whose version can change a result
DISTRIBUTIONS = (
    "geopandas",
    "jinja2",
    "maplibre",
    "matplotlib",
    "numba",
    "numpy",
    "pandas",
    "pyarrow",
    "pyogrio",
    "pyproj",
    "pyvista",
    "scipy",
    "shapely",
)

#: ends of the names of files that the program consists of
SOURCES = (".py", ".csv", ".toml", ".jinja", ".css", ".js")


@cache
def versions() -> dict[str, str]:
    """Versions of Python, of this package and of those that it computes with."""
    found = {"python": platform.python_version(), "uxsim-geo": uxsim_geo.version.__version__}
    return found | {name: metadata.version(name) for name in DISTRIBUTIONS}


def machine() -> dict[str, Any]:
    """What of the computer can matter for the last digits, and for how long a run took."""
    return {
        "system": platform.platform(),
        "processor": platform.machine(),
        "processors": os.cpu_count(),
    }


def other_versions(record: StageRecord, advice: str = "") -> Iterator[str]:
    """Say with which other versions of libraries a stage was made, if with any.

    That makes nothing out of date: a result is only bound to be the same with the same versions.
    """
    now = versions()
    others = [
        f"{name} {then} (now {now.get(name, 'none')})"
        for name, then in record.versions.items()
        if now.get(name) != then
    ]
    if others:
        yield f"made with {', '.join(others)}" + (f", {advice}" if advice else "")


@cache
def code_digest() -> str:
    """SHA-256 over the program's own source: a result made by other code is out of date.

    Tables of assumptions and templates of pages belong to it, the examples do not.
    """
    digest = hashlib.sha256()
    for package in (Path(__file__).parent, Path(uxsim_geo.version.__file__).parent):
        for path in sorted(package.rglob("*")):
            if path.suffix in SOURCES and not path.is_relative_to(INSTALLED):
                digest.update(path.relative_to(package.parent).as_posix().encode())
                digest.update(path.read_bytes())
    return digest.hexdigest()
