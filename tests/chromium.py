"""A page in headless Chromium, driven by its DevTools protocol over two pipes; nothing to install.

The browser has no network: every name fails to resolve, and requests are recorded all the same.
"""

from __future__ import annotations

import base64
import fcntl
import json
import os
import select
import shutil
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome-stable", "google-chrome")
FLAGS = (
    "--headless=new",
    "--no-sandbox",  # the tests may run as root, where Chromium refuses its sandbox
    "--disable-dev-shm-usage",
    "--use-angle=swiftshader",  # software rendering, everywhere the same
    "--enable-unsafe-swiftshader",
    "--host-resolver-rules=MAP * ~NOTFOUND",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--remote-debugging-pipe",
)

#: seconds until a browser that does not answer is given up
PATIENCE = 120.0


def chromium() -> str:
    """The browser's path; skips the test where there is none."""
    for name in NAMES:
        if found := shutil.which(name):
            return found
    pytest.skip("Chromium is not installed (on Debian: apt-get install chromium)")


class Tab:
    """One tab: commands, scripts, input, and everything that the page complains of."""

    def __init__(self, to_browser: int, from_browser: int) -> None:
        self._to, self._from = to_browser, from_browser
        self._unread = b""
        self._number = 0
        self._session: str | None = None
        self.complaints: list[str] = []
        self.requests: list[str] = []
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        attached = self.call("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        """Send a command and wait for its answer; events on the way are noted."""
        self._number += 1
        message: dict[str, Any] = {"id": self._number, "method": method, "params": params}
        if self._session is not None:
            message["sessionId"] = self._session
        os.write(self._to, json.dumps(message).encode() + b"\0")
        while (answer := self._next()).get("id") != self._number:
            self._note(answer)
        assert "error" not in answer, f"{method}: {answer['error']}"
        result: dict[str, Any] = answer["result"]
        return result

    def _next(self) -> dict[str, Any]:
        until = time.monotonic() + PATIENCE
        while b"\0" not in self._unread:
            ready, _, _ = select.select([self._from], [], [], max(until - time.monotonic(), 0.0))
            assert ready, "the browser does not answer"
            content = os.read(self._from, 1 << 16)
            assert content, "the browser is gone"
            self._unread += content
        line, _, self._unread = self._unread.partition(b"\0")
        message: dict[str, Any] = json.loads(line)
        return message

    def _note(self, event: dict[str, Any]) -> None:
        params = event.get("params", {})
        match event.get("method"):
            case "Runtime.exceptionThrown":
                details = params["exceptionDetails"]
                self.complaints.append(details.get("exception", details).get("description", ""))
            case "Runtime.consoleAPICalled" if params["type"] in ("error", "warning", "assert"):
                self.complaints.append(str([one.get("value") for one in params["args"]]))
            case "Log.entryAdded" if params["entry"]["level"] in ("error", "warning"):
                self.complaints.append(params["entry"]["text"])
            case "Network.requestWillBeSent":
                self.requests.append(params["request"]["url"])

    def open(self, path: Path) -> None:
        """Open a file and wait until the page says that it is ready."""
        self.call("Page.navigate", url=path.as_uri())
        self.wait_for("document.documentElement?.dataset.ready === 'true'")

    def run(self, script: str) -> Any:
        """The value of an expression, or of the promise that it makes."""
        answer = self.call(
            "Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True
        )
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def wait_for(self, condition: str) -> None:
        """Look at a condition before every frame until it holds."""
        self.run(
            "new Promise((done) => { const look = () => ("
            f"({condition}) ? done(true) : setTimeout(look, 10)); look(); }})"
        )

    def size(self, width: int, height: int) -> None:
        """Set the window's inner size, pixels."""
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=False,
        )

    def media(self, scheme: str, kind: str = "") -> None:
        """Ask for a light or dark page, and for another medium, as print."""
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        self.call("Emulation.setEmulatedMedia", media=kind, features=features)

    def mouse(self, kind: str, x: float, y: float) -> None:
        """Move, or press and release, at a place in the window."""
        if kind == "move":
            self.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)
            return
        for step in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=step, x=x, y=y, button="left", clickCount=1)

    def key(self, name: str, text: str = "", code: int = 0) -> None:
        """Press and release a key."""
        common: dict[str, Any] = {"key": name, "code": name, "windowsVirtualKeyCode": code}
        self.call("Input.dispatchKeyEvent", type="keyDown", text=text, **common)
        self.call("Input.dispatchKeyEvent", type="keyUp", **common)

    def picture(self, path: Path, *, whole: bool = False) -> None:
        """Save what is seen, or the whole page, as PNG."""
        data = self.call("Page.captureScreenshot", captureBeyondViewport=whole)["data"]
        path.write_bytes(base64.b64decode(data))

    def printed(self, path: Path) -> None:
        """Save the page as it is printed on A4."""
        paper = {"paperWidth": 8.27, "paperHeight": 11.69}
        data = self.call("Page.printToPDF", printBackground=False, **paper)["data"]
        path.write_bytes(base64.b64decode(data))


@contextmanager
def opened(folder: Path, *flags: str) -> Iterator[Tab]:
    """A browser with one tab; ``folder`` takes its profile. It ends with the block."""
    commands, answers = os.pipe(), os.pipe()
    # the browser reads from 3 and writes to 4, where pipes of ours may be already
    theirs = [fcntl.fcntl(end, fcntl.F_DUPFD, 64) for end in (commands[0], answers[1])]
    arguments = [chromium(), *FLAGS, *flags, f"--user-data-dir={folder}"]
    quiet = os.open(os.devnull, os.O_RDWR)
    actions = [
        *((os.POSIX_SPAWN_DUP2, quiet, standard) for standard in (0, 1, 2)),
        *((os.POSIX_SPAWN_DUP2, end, number) for end, number in zip(theirs, (3, 4), strict=True)),
        *((os.POSIX_SPAWN_CLOSE, end) for end in theirs),
    ]
    child = os.posix_spawn(arguments[0], arguments, os.environ, file_actions=actions, setpgroup=0)
    for end in (*theirs, commands[0], answers[1], quiet):
        os.close(end)
    try:
        yield Tab(commands[1], answers[0])
    finally:
        os.killpg(child, signal.SIGKILL)
        os.waitpid(child, 0)
        os.close(commands[1])
        os.close(answers[0])
