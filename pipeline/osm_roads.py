"""Roads that a configuration names by a place, a box or a polygon: downloaded once, then kept."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.downloads import announced_wait
from pipeline.ingest_config_formats import OsmSection
from uxsim_geo.user_cache import user_cache

if TYPE_CHECKING:
    from uxsim_geo.network.osm_download import Download

#: the key that names the cache, whose other files are no inputs of a run
CACHE = "osm.cache"

#: the name of the input that was downloaded
DOWNLOAD = "osm.download"


def downloaded_files(section: OsmSection | None) -> dict[str, Path]:
    """Return the download that a run reads, by a name; nothing where it reads none."""
    query = None if section is None else section.query()
    if section is None or query is None:
        return {}
    path = _folder(section) / query.file_name()
    return {DOWNLOAD: path} if path.is_file() else {}


def fetch_roads(section: OsmSection, say: Callable[[str], None]) -> None:
    """See to it that the roads are in the cache, and say of when they are."""
    from uxsim_geo.network.osm_download import cached_osm, download_osm

    query, folder = section.query(), _folder(section)
    if query is None:
        return
    kept = None if section.refresh else cached_osm(query, folder)
    if kept is not None:
        say(f"ingest: roads of {query}, from the cache: {kept}")
        return
    say(f"ingest: asking for the roads of {query}")
    servers = replace(section.servers(), wait=announced_wait(say))
    asked = download_osm(query, folder, refresh=True, servers=servers)
    say(f"ingest: roads of {query}: {asked}")


def roads_of(section: OsmSection) -> Download:
    """Return the roads in the cache, downloaded where they are not yet there."""
    from uxsim_geo.network.osm_download import download_osm

    query = section.query()
    assert query is not None, "roads in a file are not downloaded"
    return download_osm(query, _folder(section), servers=section.servers())


def _folder(section: OsmSection) -> Path:
    return section.cache or user_cache() / "osm"
