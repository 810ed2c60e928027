"""What this machine has to offer."""

from __future__ import annotations

import os


def cores() -> int:
    """Return how many threads of this process can compute at once here."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
