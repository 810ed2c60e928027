"""The command ``fetch``: which open data are known by name, and how a run uses them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from pipeline.columns import align
from pipeline.results import size_in_words
from pipeline.tntp_sources import fetch_network, tntp_shelf

if TYPE_CHECKING:
    from uxsim_geo.network.tntp_collection import KnownNetwork
    from uxsim_geo.network.tntp_download import Shelf

#: ingest.trips of a configuration for a network that has a file of them
WITH_TRIPS = """  trips:
    demand_period_s: 3600 # over which its trips depart: the file does not say
"""

#: ingest.demand where it has none
WITHOUT_TRIPS = """  demand: # the data set has no trips: an OD table of yours, or other demand
    - od: {file: od.csv}
      demand_period_s: 3600
"""


def known_data() -> str:
    """Describe all data sets: what they are, their files, and which of them are in the cache."""
    shelf = tntp_shelf()
    head = ("data set", "zones", "links", "size", "in cache", "files")
    known = shelf.collection.networks.values()
    table = align([head, *(_row(shelf, network) for network in known)], right=(1, 2, 3))
    title, *lines = table.splitlines()
    parts = [f"{shelf.collection.source}\n{shelf.collection.terms}\ncache: {shelf.folder}\n", title]
    for line, network in zip(lines, known, strict=True):
        parts.append(f"{line}\n    {_description(network)}")
    return "\n".join(parts)


def fetch_data(name: str, say: Callable[[str], None]) -> str:
    """Download a data set where it is not yet there; return a configuration that uses it.

    Raises :class:`uxsim_geo.errors.InputError` for unknown names, and where files cannot be had.
    """
    shelf = tntp_shelf()
    network = shelf.collection.find(name)
    paths = fetch_network(network, tuple(network.files), say)
    say(
        f"{network.name}: {len(paths)} files in {shelf.folder_of(network)}, sizes and SHA-256 right"
    )
    return _configuration(shelf, network)


def _row(shelf: Shelf, network: KnownNetwork) -> tuple[str, ...]:
    files = network.files
    there = len(files) - len(shelf.lacking(network, files))
    return (
        network.name,
        f"{network.zones:,}",
        f"{network.links:,}",
        size_in_words(network.size),
        {0: "no", len(files): "yes"}.get(there, f"{there} of {len(files)}"),
        " ".join(files),
    )


def _description(network: KnownNetwork) -> str:
    return f"{network.about}: {network.note}" if network.note else network.about


def _configuration(shelf: Shelf, network: KnownNetwork) -> str:
    keys = "".join(f"  {key}: {value}\n" for key, value in network.keys.items())
    trips = WITH_TRIPS if "trips" in network.files else WITHOUT_TRIPS
    return f"""# {_description(network)}
# {shelf.collection.source}
# {shelf.collection.terms}
name: {network.name.lower()}
ingest:
  dataset: {network.name} # downloaded where it is not in the cache
{keys}{trips}simulate:
  duration_s: 7200"""
