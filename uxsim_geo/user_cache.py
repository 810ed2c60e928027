"""Where on a user's computer lies what can be had again: downloads and compiled code."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path


def user_cache() -> Path:
    """Return the folder for what can be had again, by what the environment says of it."""
    own, shared = os.environ.get("UXSIM_GEO_CACHE"), os.environ.get("XDG_CACHE_HOME")
    if own:
        return Path(own).expanduser().resolve()
    # a relative path in that variable does not count, says its specification
    caches = Path(shared) if shared and Path(shared).is_absolute() else _home() / ".cache"
    return caches / "uxsim-geo"


def _home() -> Path:
    try:
        return Path.home()
    except RuntimeError:  # a user without one, as in some containers
        return Path(tempfile.gettempdir())
