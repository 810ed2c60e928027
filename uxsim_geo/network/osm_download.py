"""Roads of OpenStreetMap by the name of a place, a box or a polygon: asked for once, then kept.

A file of the cache is an ordinary .osm.gz. Beside it, with ``.json`` after its name, stands how it
came: question, date of the map, servers, SHA-256. Only with that is it believed.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from uxsim_geo.errors import Fault, Faults, InputError
from uxsim_geo.files import replace_when_complete, sha256_of
from uxsim_geo.network.bounded_http import Refusal, Unreachable
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes, with_notes_in_front
from uxsim_geo.network.osm_answer import ATTRIBUTION, LICENCE, read_answer, write_osm_xml
from uxsim_geo.network.osm_query import OsmQuery, area_km2, overpass_question
from uxsim_geo.network.osm_servers import Servers, ask_overpass, find_place

#: grows whenever the meaning of the side file's entries changes
RECORD_FORMAT = 1

#: what can be done where there is no network
BY_HAND = (
    "without a network, fetch an extract elsewhere (download.geofabrik.de, or the export of "
    "openstreetmap.org) and name it as file, or copy {name} and {name}.json from another "
    "computer's cache to {folder}"
)


@dataclass(frozen=True)
class Download:
    """A file of roads, and how it came.

    query
        what was asked for, as :meth:`OsmQuery.described` says it
    found, others
        what the geocoder took the place for (its full name), and how many other places match;
        without a place empty and 0
    area_km2
        the size of the area
    data_date, downloaded
        of when the map is (Overpass' osm_base), when it was asked for; ISO 8601, UTC
    overpass, nominatim
        the servers asked
    question
        to Overpass
    sha256
        of the file, hexadecimal
    elements
        numbers of nodes, ways and relations
    """

    path: Path
    query: Mapping[str, Any]
    found: str
    others: int
    area_km2: float
    data_date: str
    downloaded: str
    overpass: str
    nominatim: str
    question: str
    sha256: str
    elements: Mapping[str, int]

    def __str__(self) -> str:
        what = f"{self.found}; " if self.found else ""
        return f"{what}map of {self.data_date}, downloaded {self.downloaded}"


def cached_osm(query: OsmQuery, folder: Path) -> Download | None:
    """Return the download of this question that is in ``folder``, or None where there is none.

    Raises :class:`uxsim_geo.errors.InputError` where it is not as it was downloaded.
    """
    path = folder / query.file_name()
    record = _record_path(path)
    if not (path.is_file() and record.is_file()):
        return None
    try:
        told = json.loads(record.read_text(encoding="utf-8"))
        sound = told.pop("format") == RECORD_FORMAT
        told.pop("attribution"), told.pop("licence"), told.pop("file")
        download = Download(path, **told)
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        what = f"does not say how the roads came ({error}); refresh: true asks for them again"
        raise InputError([Fault(what, str(record))]) from error
    if not sound or sha256_of(path) != download.sha256:
        what = "is not as it was downloaded; refresh: true asks for it again"
        raise InputError([Fault(what, str(path))])
    return download


def download_osm(
    query: OsmQuery, folder: Path, *, refresh: bool = False, servers: Servers | None = None
) -> Download:
    """Return the roads of a question: those in the cache ``folder``, or asked for.

    ``refresh`` asks whatever the cache holds; where that fails, it keeps what it has. Raises
    :class:`uxsim_geo.errors.InputError` where the place is not known, the area is none or too
    large, or the servers do not answer as they should.
    """
    kept = None if refresh else cached_osm(query, folder)
    if kept is not None:
        return kept
    faults = Faults(f"roads of {query}")
    try:
        download = _download(query, folder, servers or Servers(), faults)
    except Refusal as refusal:
        faults.add(f"{refusal}{_advice(refusal, query, folder)}")
    except OSError as error:
        faults.add(f"cannot be written to the cache {folder}: {error.strerror}")
    faults.raise_if_any()
    return download


def _advice(refusal: Refusal, query: OsmQuery, folder: Path) -> str:
    """How to go on without the servers, where that is what is missing."""
    name = query.file_name()
    if (folder / name).is_file() and _record_path(folder / name).is_file():
        return f"; refresh: false uses what was downloaded before to {folder}"
    if isinstance(refusal, Unreachable):
        return f"; {BY_HAND.format(name=name, folder=folder)}"
    return ""


def _download(query: OsmQuery, folder: Path, servers: Servers, faults: Faults) -> Download:
    """Ask, check, write the file and then what vouches for it."""
    found, others, nominatim = "", 0, ""
    if query.place is not None:
        place, nominatim = find_place(query.place, servers)
        area, found, others = place.area, place.name, place.others
    else:
        area = query.area()
    size = area_km2(area)
    _check_size(size, servers, faults)
    question = overpass_question(area, query.road_classes, servers.timeout_s)
    content, overpass = ask_overpass(question, servers)
    answer = read_answer(content, faults)
    faults.raise_if_any()
    assert answer is not None, "an answer without elements is a fault"
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / query.file_name()
    # until the new record is there, nothing vouches for the new file
    _record_path(path).unlink(missing_ok=True)
    write_osm_xml(answer, path)
    download = Download(
        path=path,
        query=query.described(),
        found=found,
        others=others,
        area_km2=round(size, 3),
        data_date=answer.data_date,
        downloaded=datetime.now(UTC).isoformat(timespec="seconds"),
        overpass=overpass,
        nominatim=nominatim,
        question=question,
        sha256=sha256_of(path),
        elements=answer.counts(),
    )
    _write_record(download)
    return download


def _check_size(size: float, servers: Servers, faults: Faults) -> None:
    if not size > 0:
        faults.add("there is no area of that place; give a bbox or a polygon in its stead")
    if size > servers.max_area_km2:
        faults.add(
            f"an area of {size:,.0f} km² is more than the {servers.max_area_km2:,.0f} km² that "
            "public servers should be asked for; take a smaller one, or an extract (as of "
            "download.geofabrik.de) as file"
        )
    faults.raise_if_any()


def note_download(network: Network, download: Download) -> Network:
    """Return the network with notes, in front of its own, of where its roads came from."""
    notes = Notes()
    asked = ", ".join(f"{key} {value}" for key, value in download.query.items() if key == "place")
    what = asked or next(key for key in ("bbox", "polygon") if key in download.query)
    came = f"{what}, map of {download.data_date}, downloaded {download.downloaded}"
    notes.add("source", f"{ATTRIBUTION} ({LICENCE}): {came}", value=download.overpass)
    notes.add("source", f"SHA-256 of {download.path.name}", value=download.sha256)
    notes.add("source", "question to Overpass", value=download.question)
    if download.found:
        others = f"; {download.others} other matches were passed over" if download.others else ""
        note = f"the geocoder's place (value) was taken{others}"
        notes.add("source", note, value=download.found)
    return with_notes_in_front(network, notes)


def _write_record(download: Download) -> None:
    told = {key: value for key, value in asdict(download).items() if key != "path"}
    about = {
        "format": RECORD_FORMAT,
        "attribution": ATTRIBUTION,
        "licence": LICENCE,
        "file": download.path.name,
    }
    with replace_when_complete(_record_path(download.path)) as temporary:
        text = json.dumps(about | told, indent=1, ensure_ascii=False) + "\n"
        temporary.write_text(text, encoding="utf-8")


def _record_path(path: Path) -> Path:
    return path.with_name(f"{path.name}.json")
