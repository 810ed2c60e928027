"""Who is to be named where a run is shown: on every picture, map, page and file of it."""

from __future__ import annotations

from pipeline.config import Config
from pipeline.ingest_config import IngestSection
from uxsim_geo.network.tntp_collection import read_collection

OPENSTREETMAP = "© OpenStreetMap contributors, ODbL"
ODBL = "https://opendatacommons.org/licenses/odbl/1-0/"


def attribution(config: Config) -> str:
    """Who is to be named, in a short line; empty: nobody that is known.

    What the configuration says, else the owners of the data.
    """
    told = config.report.attribution
    return owners(config.ingest) if told is None else told


def owners(section: IngestSection) -> str:
    """Whose data are read, of those that ingestion knows by name."""
    if section.format == "osm":
        return OPENSTREETMAP
    known = section.dataset_network
    if known is None or not section.roles_of_dataset():
        return ""
    return f"{known.name}: {read_collection().credit}"


def licence(config: Config) -> str:
    """On what terms the data of its sources may be shared; empty: none that is known."""
    if config.ingest.format == "osm":
        return ODBL
    return read_collection().terms if owners(config.ingest) else ""
