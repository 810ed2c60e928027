"""Who is to be named where a run is shown: on every picture, map, page and file of it."""

from __future__ import annotations

from pipeline.config import Config
from uxsim_geo.network.tntp_collection import read_collection

OPENSTREETMAP = "© OpenStreetMap contributors, ODbL"


def attribution(config: Config) -> str:
    """Who is to be named, in a short line; empty: nobody that is known.

    What the configuration says, else the owners of open data that ingestion knows by name.
    """
    if config.report.attribution is not None:
        return config.report.attribution
    if config.ingest.format == "osm":
        return OPENSTREETMAP
    known = config.ingest.dataset_network
    if known is None or not config.ingest.roles_of_dataset():
        return ""
    return f"{known.name}: {read_collection().credit}"
