"""What the benchmarks ran on: machine, versions, date."""

from __future__ import annotations

import os
import platform
import re
import subprocess
import sys
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path

LIBRARIES = ("numpy", "numba", "pandas", "scipy")


def machine() -> dict[str, object]:
    """Describe the machine, the interpreter and its libraries."""
    return {
        "date": datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        "processor": processor(),
        "cores": os.cpu_count(),
        "memory_gb": os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9,
        "system": f"{platform.system()} {platform.release()}",
        "python": platform.python_version(),
        "libraries": {name: metadata.version(name) for name in LIBRARIES},
        "load": os.getloadavg()[0],
    }


def processor() -> str:
    """Name of the processor, as the system tells it."""
    if sys.platform == "linux":
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
        found = {key.strip(): value.strip() for key, _, value in _pairs(text)}
        if name := found.get("model name"):
            return f"{name} (family {found['cpu family']}, model {found['model']})"
    return platform.processor() or platform.machine()


def _pairs(text: str) -> list[tuple[str, str, str]]:
    return [line.partition(":") for line in text.splitlines()]


def version_in(python: str, package: str) -> str | None:
    """The version of a package that another interpreter has; None: it has none."""
    program = "import sys; from importlib import metadata; print(metadata.version(sys.argv[1]))"
    command = [python, "-c", program, package]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    return done.stdout.strip() if done.returncode == 0 else None


def sumo_version(sumo: str) -> str | None:
    """The version of SUMO; None where it cannot be run."""
    try:
        done = subprocess.run([sumo, "--version"], check=False, capture_output=True, text=True)
    except OSError:
        return None
    found = re.search(r"sumo (?:Version )?v?([0-9][0-9.]*)", done.stdout)
    return found[1] if done.returncode == 0 and found else None
