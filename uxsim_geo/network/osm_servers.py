"""Talking to Nominatim and Overpass by way of OSMnx.

OSMnx finds places and holds the servers' addresses; its graphs lack restrictions on turning, so
the roads are asked for here, with its settings. It would wait and ask again for ever: the hooks of
:mod:`uxsim_geo.network.bounded_http` stop it before that.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from uxsim_geo.network.bounded_http import Patience, Refusal, asked, bounded
from uxsim_geo.version import __version__

#: what OSMnx raises where a geocoder's answer is empty, or not of the kind it knows
_NO_PLACE = (ValueError, TypeError, KeyError, IndexError, AttributeError, RecursionError)

#: bytes that the geocoder may answer
PLACE_BYTES = 50_000_000


#: what may help where a server stays busy, or answers too much
SMALLER_AREA = "take a smaller area, or an extract (as of download.geofabrik.de) as file"
TOO_BUSY = "try again later, with a smaller area or another server"


@dataclass(frozen=True)
class Servers(Patience):
    """Whom to ask, how much of them, and how long to wait for it.

    overpass_url, nominatim_url
        None: those of ``osmnx.settings``, which are the public ones unless changed there
    timeout_s
        Overpass is told to work no longer than that
    max_mb
        of roads in an answer, 10⁶ bytes once unpacked
    max_area_km2
        larger areas are not asked for: they are what extracts are made for
    """

    overpass_url: str | None = None
    nominatim_url: str | None = None
    max_mb: float = 100.0
    max_area_km2: float = 2500.0


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

        return asked(ask, url, servers, TOO_BUSY), url


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

        return asked(ask, url, servers, TOO_BUSY), url


@contextmanager
def osmnx_settings(servers: Servers, most_bytes: int) -> Iterator[Any]:
    """Settings of OSMnx for polite and bounded questions; afterwards they are what they were."""
    from osmnx import settings

    agent = f"uxsim-geo/{__version__} (traffic simulation, by way of OSMnx)"
    too_large = f"the answer is larger than {most_bytes / 1e6:g} MB; {SMALLER_AREA}"
    own = {
        "use_cache": False,
        "overpass_url": servers.overpass_url or settings.overpass_url,
        "nominatim_url": servers.nominatim_url or settings.nominatim_url,
        "requests_timeout": servers.timeout_s,
        "http_user_agent": agent,
        "http_referer": agent,
        "requests_kwargs": settings.requests_kwargs
        | {
            "allow_redirects": False,
            "hooks": {"response": bounded(servers, most_bytes, too_large)},
        },
    }
    before = {name: getattr(settings, name) for name in (*own, "cache_folder")}
    try:
        for name, value in own.items():
            setattr(settings, name, value)
        yield settings
    finally:
        for name, value in before.items():
            setattr(settings, name, value)


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
