"""What all downloads share: where they are kept, and what is said while a server is busy."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path


def data_cache() -> Path:
    """Return the folder for what is downloaded, by what the environment says of it."""
    own, shared = os.environ.get("UXSIM_GEO_CACHE"), os.environ.get("XDG_CACHE_HOME")
    if own:
        return Path(own).expanduser().resolve()
    # a relative path in that variable does not count, says its specification
    caches = Path(shared) if shared and Path(shared).is_absolute() else Path.home() / ".cache"
    return caches / "uxsim-geo"


def announced_wait(say: Callable[[str], None]) -> Callable[[float], None]:
    """Return what waits until a busy server can be asked again, and says so before."""

    def wait(seconds: float) -> None:
        say(f"the server is busy; it is asked again in {seconds:.0f} s")
        time.sleep(seconds)

    return wait
