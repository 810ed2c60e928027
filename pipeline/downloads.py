"""What all downloads share: what is said while a server is busy."""

from __future__ import annotations

import time
from collections.abc import Callable


def announced_wait(say: Callable[[str], None]) -> Callable[[float], None]:
    """Return what waits until a busy server can be asked again, and says so before."""

    def wait(seconds: float) -> None:
        say(f"the server is busy; it is asked again in {seconds:.0f} s")
        time.sleep(seconds)

    return wait
