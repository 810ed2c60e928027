"""What the process of one run measures of itself; with nothing but the standard library.

Any interpreter runs it, that in which a peer is installed too.
"""

from __future__ import annotations

import json
import os
import resource
import sys
from dataclasses import dataclass
from pathlib import Path

MB = 1e6
RSS_UNIT = 1 if sys.platform == "darwin" else 1024  # bytes in ru_maxrss


@dataclass(frozen=True)
class Told:
    """What a run is told, on its command line: the folder of the case's tables, and options."""

    folder: Path
    options: dict

    @property
    def case(self) -> dict:
        """Settings of the case: platoon_size, duration, route_update_interval ..."""
        return json.loads((self.folder / "case.json").read_text(encoding="utf-8"))


def told() -> Told:
    """Read the command line: FOLDER OPTIONS, the options as JSON."""
    return Told(Path(sys.argv[1]), json.loads(sys.argv[2]))


def resident_mb() -> float:
    """Memory that this process holds now, MB; at most so far, where the system does not say."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    except OSError:
        return peak_mb()
    return pages * os.sysconf("SC_PAGE_SIZE") / MB


def peak_mb() -> float:
    """Memory that this process has held at most, MB.

    Linux tells it of this program alone; what getrusage gives counts that of its parent, too.
    """
    try:
        for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024 / MB
    except OSError:
        pass  # another system
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * RSS_UNIT / MB


def give(figures: dict) -> None:
    """Print the figures of a run where :mod:`turns` reads them: in the last line."""
    print(json.dumps(figures), flush=True)
