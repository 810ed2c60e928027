"""Which pairs of nodes a path connects, when some turns are banned or some nodes not passed."""

from __future__ import annotations

import numpy as np
import pandas as pd

from uxsim_geo.network.network import Network
from uxsim_geo.network.paths import Paths


def reachable_pairs(network: Network, origin: pd.Series, destination: pd.Series) -> np.ndarray:
    """Whether a path leads from each origin to the destination beside it; boolean, one a pair."""
    ids = pd.Index(network.nodes["node_id"])
    return Paths.of(network).lead(ids.get_indexer(origin), ids.get_indexer(destination))
