"""Questions to servers on the network: politely, and never without bounds.

requests would read answers of any size for as long as they trickle in, and follow to any host: a
hook on every answer stops it before that. What asks may be requests itself, or a library on it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar
from urllib.parse import urlsplit

from uxsim_geo.version import __version__

if TYPE_CHECKING:
    import requests

_Answer = TypeVar("_Answer")

#: who asks
AGENT = f"uxsim-geo/{__version__} (traffic simulation)"

#: answers after which a server may be asked again, and what they mean
BUSY = {
    429: "too many questions at once from this address",
    502: "the server behind it does not answer",
    503: "the server is not available",
    504: "the server is too busy for it",
}

#: s to wait before asking again, and at most, whatever the server says
WAIT_S, LONGEST_WAIT_S = 30.0, 120.0

#: a whole answer may take so many times the time-out, in case it trickles in
LONGEST_ANSWER = 4


@dataclass(frozen=True, kw_only=True)
class Patience:
    """How long and how often to wait for an answer.

    timeout_s
        without a sign of life
    attempts
        to ask a busy server
    wait
        does the waiting, given s
    """

    timeout_s: float = 180.0
    attempts: int = 3
    wait: Callable[[float], None] = time.sleep


class Refusal(Exception):  # noqa: N818  a server refuses; that is no fault of the program
    """An answer that is not what was asked for; ``wait_s``: after that it can be asked again."""

    def __init__(self, what: str, wait_s: float | None = None) -> None:
        super().__init__(what)
        self.wait_s = wait_s


class Unreachable(Refusal):
    """No answer at all."""


def get_file(url: str, size: int, patience: Patience) -> bytes:
    """Return a file of a known size in bytes; a longer one is not read to its end. Raises Refusal.

    Proxies and certificates are those that requests finds in the environment.
    """
    import requests

    too_large = f"the answer is longer than the file, which has {size:,} bytes"

    def ask() -> bytes:
        answer = requests.get(
            url,
            headers={"User-Agent": AGENT},
            timeout=patience.timeout_s,
            allow_redirects=False,
            hooks={"response": bounded(patience, size, too_large)},
        )
        return answer.content

    return asked(ask, url, patience, "try again later")


def asked(ask: Callable[[], _Answer], url: str, patience: Patience, too_busy: str) -> _Answer:
    """Ask, and again while a server is busy, as often as is decent.

    ``url`` is who is asked; ``too_busy`` is what to do if the server stays busy. Raises Refusal.
    """
    import requests

    for attempt in range(1, patience.attempts + 1):
        try:
            return ask()
        except Refusal as refusal:
            if refusal.wait_s is None:
                raise Refusal(f"{url}: {refusal}") from refusal
            if attempt == patience.attempts:
                raise Refusal(f"{url}: {refusal}; asked {attempt} times: {too_busy}") from refusal
            patience.wait(min(refusal.wait_s, LONGEST_WAIT_S))
        except requests.Timeout as error:
            what = f"{_server(url)}: no answer within {patience.timeout_s:g} s; try again later"
            raise Unreachable(what) from error
        except requests.ConnectionError as error:
            raise Unreachable(f"{_server(url)} cannot be reached ({_cause(error)})") from error
        except requests.RequestException as error:
            raise Refusal(f"{url}: the answer cannot be read or was cut off: {error}") from error
    raise AssertionError("the last attempt returns or raises")


def bounded(patience: Patience, most_bytes: int, too_large: str) -> Callable[..., None]:
    """Return a hook that looks at each answer before its content is read.

    ``too_large`` says why an answer of more than ``most_bytes``, once unpacked, is not read.
    """

    def look(response: requests.Response, *_: object, **__: object) -> None:
        status = response.status_code
        if status == 200:
            latest = time.monotonic() + LONGEST_ANSWER * patience.timeout_s
            response.raw = _Measured(response.raw, most_bytes, latest, too_large)
            return
        response.close()
        if status in BUSY:
            wait_s = _seconds(response.headers.get("Retry-After"))
            raise Refusal(f"answers {status}: {BUSY[status]}", wait_s)
        if 300 <= status < 400:
            where = response.headers.get("Location", "nowhere")
            what = f"sends on to {where}, which is not followed; if it is to be trusted, ask there"
            raise Refusal(what)
        raise Refusal(f"answers {status} {response.reason}")

    return look


class _Measured:
    """The body of an answer, as requests reads it, up to a size and a time."""

    def __init__(self, raw: Any, most_bytes: int, latest: float, too_large: str) -> None:
        self.raw, self.most_bytes, self.latest = raw, most_bytes, latest
        self.too_large = too_large

    def __getattr__(self, name: str) -> Any:
        return getattr(self.raw, name)

    def stream(self, amount: int, decode_content: bool | None = None) -> Iterator[bytes]:
        """Yield the body as it comes in, unpacked: a whole block might be waited for too long."""
        read = 0
        while block := self.raw.read1(amount, decode_content=decode_content):
            read += len(block)
            if read > self.most_bytes:
                self.raw.close()
                raise Refusal(self.too_large)
            if time.monotonic() > self.latest:
                self.raw.close()
                raise Refusal("the answer comes in too slowly; try again later")
            yield block


def _server(url: str) -> str:
    """The part of an address that says who is asked, and not for what."""
    parts = urlsplit(url)
    return f"{parts.scheme}://{parts.netloc}"


def _seconds(told: str | None) -> float:
    """What Retry-After says, where that is a number of seconds."""
    return float(told) if told is not None and told.isdecimal() else WAIT_S


def _cause(error: BaseException) -> str:
    """The innermost reason, which is the one that says something."""
    while error.__cause__ or error.__context__:
        error = error.__cause__ or error.__context__ or error
    return str(error)
