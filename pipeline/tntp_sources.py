"""Files of a TNTP network: those that a configuration names, and those of its data set."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.downloads import announced_wait
from pipeline.ingest_config import IngestSection
from uxsim_geo.network.tntp_collection import KnownNetwork, Role, read_collection
from uxsim_geo.user_cache import user_cache

if TYPE_CHECKING:
    from uxsim_geo.network.network import Network
    from uxsim_geo.network.tntp_download import Shelf


#: how names of inputs begin that are files of a data set
DATASET = "dataset."


def tntp_shelf() -> Shelf:
    """Return where the files of data sets are kept."""
    from uxsim_geo.network.tntp_download import Shelf

    return Shelf(read_collection(), user_cache() / "tntp")


def fetch_network(
    network: KnownNetwork, roles: Sequence[Role], say: Callable[[str], None]
) -> dict[Role, Path]:
    """See to it that files of a network are in the cache; return where they lie."""
    from uxsim_geo.network.bounded_http import Patience
    from uxsim_geo.network.tntp_download import download_network

    patience = Patience(timeout_s=30.0, wait=announced_wait(say))
    return download_network(tntp_shelf(), network, roles, patience=patience, say=say)


def dataset_inputs(section: IngestSection) -> dict[str, Path]:
    """Return the files of the data set that a run reads, by a name; those that are there."""
    network = section.dataset_network
    if network is None:
        return {}
    shelf = tntp_shelf()
    paths = {
        f"{DATASET}{role}": shelf.path_of(network, role) for role in section.roles_of_dataset()
    }
    return {name: path for name, path in paths.items() if path.is_file()}


def fetch_dataset(section: IngestSection, say: Callable[[str], None]) -> None:
    """See to it that the files of the data set, if there is one, are in the cache."""
    network = section.dataset_network
    if network is not None:
        fetch_network(network, section.roles_of_dataset(), lambda line: say(f"ingest: {line}"))


def files_of(section: IngestSection) -> dict[Role, Path]:
    """Return the files to read: the configuration's own before those of the data set."""
    own: dict[Role, Path | None] = {
        "net": section.net,
        "nodes": section.nodes,
        "flow": section.flow,
    }
    network, found = section.dataset_network, dict[Role, Path]()
    if network is not None:
        found = fetch_network(network, section.roles_of_dataset(), lambda _line: None)
    return found | {role: path for role, path in own.items() if path is not None}


def note_dataset(network: Network, section: IngestSection) -> Network:
    """Return the network with notes on the data set that it comes from, if it does."""
    from uxsim_geo.network.tntp_download import note_source

    known = section.dataset_network
    if known is None:
        return network
    return note_source(network, tntp_shelf(), known, section.roles_of_dataset())
