"""Talking to Nominatim and Overpass by way of OSMnx: politely, and never without bounds.

OSMnx finds places and holds the servers' addresses; its graphs lack restrictions on turning, so
the roads are asked for here, with its settings. It would wait and ask again for ever, read answers
of any size and follow to any host: a hook on every answer stops it before that.
"""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from uxsim_geo.version import __version__

if TYPE_CHECKING:
    import requests

_Answer = TypeVar("_Answer")

#: answers after which a server may be asked again, and what they mean
BUSY = {
    429: "too many questions at once from this address",
    502: "the server behind it does not answer",
    503: "the server is not available",
    504: "the server is too busy, or the area too large for it",
}

#: s to wait before asking again, and at most, whatever the server says
WAIT_S, LONGEST_WAIT_S = 30.0, 120.0

#: a whole answer may take so many times the time-out, in case it trickles in
LONGEST_ANSWER = 4

#: what OSMnx raises where a geocoder's answer is empty, or not of the kind it knows
_NO_PLACE = (ValueError, TypeError, KeyError, IndexError, AttributeError, RecursionError)

#: bytes that the geocoder may answer
PLACE_BYTES = 50_000_000


@dataclass(frozen=True)
class Servers:
    """Whom to ask, and how long and how much to wait for.

    overpass_url, nominatim_url
        None: those of ``osmnx.settings``, which are the public ones unless changed there
    timeout_s
        without a sign of life; Overpass is told to work no longer than that
    max_mb
        of roads in an answer, 10⁶ bytes once unpacked
    max_area_km2
        larger areas are not asked for: they are what extracts are made for
    attempts
        to ask a busy server
    wait
        does the waiting, given s
    """

    overpass_url: str | None = None
    nominatim_url: str | None = None
    timeout_s: float = 180.0
    max_mb: float = 100.0
    max_area_km2: float = 2500.0
    attempts: int = 3
    wait: Callable[[float], None] = time.sleep


class Refusal(Exception):  # noqa: N818  a server refuses; that is no fault of the program
    """An answer that is not what was asked for; ``wait_s``: after that it can be asked again."""

    def __init__(self, what: str, wait_s: float | None = None) -> None:
        super().__init__(what)
        self.wait_s = wait_s


class Unreachable(Refusal):
    """No answer at all."""


@dataclass(frozen=True)
class Found:
    """What a geocoder took a place for: its area (EPSG:4326), its name, how many others match."""

    area: Any
    name: str
    others: int


def find_place(place: str, servers: Servers) -> tuple[Found, str]:
    """Ask Nominatim for the area of a place; return it and who was asked. Raises Refusal."""
    import osmnx

    with tempfile.TemporaryDirectory() as kept, osmnx_settings(servers, PLACE_BYTES) as settings:
        # OSMnx keeps its answer there as it came: it alone tells how many places match
        settings.use_cache, settings.cache_folder = True, kept
        url = str(settings.nominatim_url)

        def ask() -> Found:
            try:
                table = osmnx.geocoder.geocode_to_gdf(place)
            except _NO_PLACE as error:
                raise Refusal(_why_no_place(place, _matches(kept), error)) from error
            name = str(table["display_name"].iloc[0]) if "display_name" in table else place
            name = name.encode("utf-8", "replace").decode()
            return Found(table.geometry.iloc[0], name, len(_matches(kept) or [place]) - 1)

        return _asked(ask, url, servers), url


def ask_overpass(question: str, servers: Servers) -> tuple[bytes, str]:
    """Put a question to Overpass; return the answer and who was asked. Raises Refusal."""
    import requests

    with osmnx_settings(servers, int(servers.max_mb * 1e6)) as settings:
        url = str(settings.overpass_url).rstrip("/")
        headers = {
            "User-Agent": settings.http_user_agent,
            "Referer": settings.http_referer,
            "Accept-Language": settings.http_accept_language,
        }

        def ask() -> bytes:
            answer = requests.post(
                f"{url}/interpreter",
                data={"data": question},
                headers=headers,
                timeout=settings.requests_timeout,
                **settings.requests_kwargs,
            )
            return answer.content

        return _asked(ask, url, servers), url


@contextmanager
def osmnx_settings(servers: Servers, most_bytes: int) -> Iterator[Any]:
    """Settings of OSMnx for polite and bounded questions; afterwards they are what they were."""
    from osmnx import settings

    agent = f"uxsim-geo/{__version__} (traffic simulation, by way of OSMnx)"
    own = {
        "use_cache": False,
        "overpass_url": servers.overpass_url or settings.overpass_url,
        "nominatim_url": servers.nominatim_url or settings.nominatim_url,
        "requests_timeout": servers.timeout_s,
        "http_user_agent": agent,
        "http_referer": agent,
        "requests_kwargs": settings.requests_kwargs
        | {"allow_redirects": False, "hooks": {"response": _bounded(servers, most_bytes)}},
    }
    before = {name: getattr(settings, name) for name in (*own, "cache_folder")}
    try:
        for name, value in own.items():
            setattr(settings, name, value)
        yield settings
    finally:
        for name, value in before.items():
            setattr(settings, name, value)


def _asked(ask: Callable[[], _Answer], url: str, servers: Servers) -> _Answer:
    """Ask, and again while a server is busy, as often as is decent."""
    import requests

    for attempt in range(1, servers.attempts + 1):
        try:
            return ask()
        except Refusal as refusal:
            if refusal.wait_s is None:
                raise Refusal(f"{url}: {refusal}") from refusal
            if attempt == servers.attempts:
                advice = "try again later, with a smaller area or another server"
                what = f"{url}: {refusal}; asked {attempt} times: {advice}"
                raise Refusal(what) from refusal
            servers.wait(min(refusal.wait_s, LONGEST_WAIT_S))
        except requests.Timeout as error:
            what = f"{url}: no answer within {servers.timeout_s:g} s; try again later"
            raise Unreachable(what) from error
        except requests.ConnectionError as error:
            raise Unreachable(f"{url} cannot be reached ({_cause(error)})") from error
        except requests.RequestException as error:
            raise Refusal(f"{url}: the answer cannot be read or was cut off: {error}") from error
    raise AssertionError("the last attempt returns or raises")


def _cause(error: BaseException) -> str:
    """The innermost reason, which is the one that says something."""
    while error.__cause__ or error.__context__:
        error = error.__cause__ or error.__context__ or error
    return str(error)


def _bounded(servers: Servers, most_bytes: int) -> Callable[..., None]:
    """A hook that looks at each answer before its content is read."""

    def look(response: requests.Response, *_: object, **__: object) -> None:
        status = response.status_code
        if status == 200:
            latest = time.monotonic() + LONGEST_ANSWER * servers.timeout_s
            response.raw = _Measured(response.raw, most_bytes, latest)
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


def _seconds(told: str | None) -> float:
    """What Retry-After says, where that is a number of seconds."""
    return float(told) if told is not None and told.isdecimal() else WAIT_S


class _Measured:
    """The body of an answer, as requests reads it, up to a size and a time."""

    def __init__(self, raw: Any, most_bytes: int, latest: float) -> None:
        self.raw, self.most_bytes, self.latest = raw, most_bytes, latest

    def __getattr__(self, name: str) -> Any:
        return getattr(self.raw, name)

    def stream(self, *arguments: Any, **more: Any) -> Iterator[bytes]:
        """Yield the body block by block, unpacked."""
        read = 0
        for block in self.raw.stream(*arguments, **more):
            read += len(block)
            if read > self.most_bytes:
                self.raw.close()
                what = f"the answer is larger than {self.most_bytes / 1e6:g} MB; take a smaller"
                raise Refusal(f"{what} area, or an extract (as of download.geofabrik.de) as file")
            if time.monotonic() > self.latest:
                self.raw.close()
                raise Refusal("the answer comes in too slowly; try again later")
            yield block


def _matches(folder: str) -> list[Any] | None:
    """What Nominatim answered, as OSMnx has kept it; None where it kept nothing."""
    for path in sorted(Path(folder).glob("*.json")):
        found = json.loads(path.read_text(encoding="utf-8"))
        if isinstance(found, list):
            return found
    return None


def _why_no_place(place: str, matches: list[Any] | None, error: Exception) -> str:
    if matches is None:
        return f"the answer about the place {place} is not what a geocoder says"
    if not matches:
        return f"no place is known by the name {place}; mend its spelling, add its country"
    if isinstance(error, TypeError) and all(isinstance(match, dict) for match in matches):
        return f"{place} is known, but not as an area; give a bbox or a polygon in its place"
    return f"the answer about the place {place} is not what a geocoder says"
