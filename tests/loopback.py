"""A server on this computer that answers as a test decides, and an address of none."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Protocol
from urllib.parse import urlsplit


@dataclass(frozen=True)
class Reply:
    """An answer out of order.

    ``cut`` promises more bytes than come; ``stalls`` keeps all but the first until the other side
    hangs up.
    """

    status: int = 200
    body: bytes = b""
    headers: dict[str, str] = field(default_factory=dict)
    cut: bool = False
    stalls: bool = False


class Answering(Protocol):
    """What answers, where it is, and who has asked."""

    url: str
    agents: list[str]

    def reply(self, path: str, text: str) -> Reply:
        """The answer to a path with its parameters, as they were sent."""


@contextmanager
def serving(state: Answering) -> Iterator[None]:
    """Let ``state`` answer on a free port of this computer, until the end of the block."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            parts = urlsplit(self.path)
            self._answer(parts.path, parts.query)

        def do_POST(self) -> None:
            sent = self.rfile.read(int(self.headers["Content-Length"]))
            self._answer(self.path, sent.decode())

        def _answer(self, path: str, text: str) -> None:
            state.agents.append(self.headers["User-Agent"])
            reply = state.reply(path, text)
            self.send_response(reply.status)
            for name, value in reply.headers.items():
                self.send_header(name, value)
            self.send_header("Content-Length", str(len(reply.body) + (100 if reply.cut else 0)))
            self.end_headers()
            self.wfile.write(reply.body[:1] if reply.stalls else reply.body)
            if reply.stalls:
                self.wfile.flush()
                self.rfile.read(1)

        def log_message(self, format: str, *arguments: object) -> None:  # noqa: A002
            """Say nothing."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    state.url = f"http://127.0.0.1:{server.server_port}"
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    try:
        yield
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def closed_port() -> str:
    """An address of this computer where nobody answers."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return f"http://127.0.0.1:{free.getsockname()[1]}"
