"""What this machine has to offer, and how much of it a run may use. No result depends on it."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from uxsim_geo.errors import Faults

GB = 1e9  # bytes


@dataclass(frozen=True)
class Machine:
    """What a run may use.

    threads
        that search for routes at the same time; None: one for each core that the process may use
    memory_gb
        that a run is let begin with, GB; None: what is free. inf: whatever it will need
    """

    threads: int | None = None
    memory_gb: float | None = None

    def __post_init__(self) -> None:
        faults = Faults("machine")
        if self.threads is not None and (not isinstance(self.threads, int) or self.threads < 1):
            faults.add("must be a whole number from 1", column="threads", value=self.threads)
        if self.memory_gb is not None and not self.memory_gb > 0:
            faults.add("must be a number above 0", column="memory_gb", value=self.memory_gb)
        faults.raise_if_any()

    @property
    def used_threads(self) -> int:
        """How many threads search for routes."""
        return self.threads or cores()

    @property
    def usable_bytes(self) -> float:
        """How much memory a run may need; inf where that cannot be told."""
        if self.memory_gb is not None:
            return self.memory_gb * GB
        return free_memory()


def cores() -> int:
    """Return how many threads of this process can compute at once here."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def free_memory(root: Path = Path("/")) -> float:
    """Return how many bytes this process can still have, by what the system says; inf: unknown.

    Of Linux that is what is available, or what is left of the limits of its control groups; of
    other systems all that they have. ``root`` is where the files of the system are.
    """
    bounds = [_available(root), *_left_of_limits(root)]
    known = [bound for bound in bounds if bound is not None]
    return min(known, default=_installed())


def _available(root: Path) -> float | None:
    for line in _lines(root / "proc/meminfo"):
        name, *rest = line.split()
        if name == "MemAvailable:" and rest and rest[0].isdigit():
            return float(rest[0]) * 1024
    return None


def _left_of_limits(root: Path) -> list[float]:
    """Return what is left of the limit of every control group that holds this process."""
    left = []
    for line in _lines(root / "proc/self/cgroup"):
        _, controllers, own = [*line.split(":", 2), "", ""][:3]
        if controllers == "":  # version 2
            folder, limit, used = root / "sys/fs/cgroup", "memory.max", "memory.current"
        elif "memory" in controllers.split(","):
            folder = root / "sys/fs/cgroup/memory"
            limit, used = "memory.limit_in_bytes", "memory.usage_in_bytes"
        else:
            continue
        group = folder / own.lstrip("/")
        for one in (group, *group.parents):
            if one == folder or folder in one.parents:
                bound, taken = _number(one / limit), _number(one / used)
                if bound is not None and taken is not None:
                    left.append(max(bound - taken + _reclaimable(one), 0.0))
    return left


def _reclaimable(group: Path) -> float:
    """Return what a group's files in memory take that nobody has used of late, bytes."""
    for line in _lines(group / "memory.stat"):
        name, _, value = line.partition(" ")
        if name in ("inactive_file", "total_inactive_file") and value.isdigit():
            return float(value)
    return 0.0


def _number(path: Path) -> float | None:
    text = "".join(_lines(path)).strip()
    return float(text) if text.isdigit() else None


def _lines(path: Path) -> list[str]:
    try:
        return path.read_text(encoding="ascii", errors="replace").splitlines()
    except OSError:
        return []


def _installed() -> float:
    try:
        return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (AttributeError, OSError, ValueError):
        return float("inf")
