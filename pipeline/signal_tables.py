"""Signals of the network itself: planned or read at ingestion, obeyed by the simulation."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.ingest_config import IngestSection

if TYPE_CHECKING:
    import pandas as pd

    from pipeline.config import Config
    from pipeline.edits import Edited
    from uxsim_geo.control.signals import Signal
    from uxsim_geo.network.network import Network
    from uxsim_geo.network.notes import Notes

#: in a run's folder, only where there are signals
SIGNALS = "network/signals.csv"


def signal_table(
    section: IngestSection, as_read: Network, edited: Edited, notes: Notes
) -> pd.DataFrame | None:
    """The plans of the configuration's table, of GMNS tables, or by the rule; None: no signals.

    Tables of plans are of the network as it was read: of them goes what edits have taken out. The
    rule plans for the network with its edits. ``notes`` collects what was assumed and left out.
    """
    from uxsim_geo.network.signal_table import read_signal_table

    if section.signal_table is not None:
        given = read_signal_table(section.signal_table, as_read, notes=notes)
        return _still_there(given, edited)
    if section.signals == "none" or not (as_read.nodes["control"] == "signal").any():
        return None
    given = _still_there(_gmns_plans(section, as_read, notes), edited)
    return _with_rule(given, edited.network, notes)


def _still_there(table: pd.DataFrame, edited: Edited) -> pd.DataFrame:
    """Leave out nodes without their signals any more, and links that are gone."""
    from uxsim_geo.scenario.links_removed import without_signals_over

    if edited.unsignalled:
        table = table[~table["node_id"].isin(edited.unsignalled)].reset_index(drop=True)
    if edited.gone:
        table = without_signals_over(table, set(edited.network.links["link_id"]))
    return table


def _with_rule(given: pd.DataFrame, network: Network, notes: Notes) -> pd.DataFrame | None:
    """Plan the signals for which no plan is given."""
    import pandas as pd

    from uxsim_geo.network.signal_plans import signal_plans

    timed = network.nodes["node_id"].isin(given["node_id"].unique())
    open_nodes = network.nodes.assign(control=network.nodes["control"].mask(timed, "none"))
    table = signal_plans(replace(network, nodes=open_nodes), notes=notes)
    table = pd.concat([given, table], ignore_index=True) if len(given) else table
    return table if len(table) else None


def _gmns_plans(section: IngestSection, network: Network, notes: Notes) -> pd.DataFrame:
    """Plans that the tables of a GMNS folder hold, those for the whole run alone."""
    from uxsim_geo.network.gmns_signals import read_gmns_signals
    from uxsim_geo.network.signal_rows import rows_of_signals, table_of

    told = section.gmns
    if told is None or not (told.folder / "signal_timing_plan.csv").is_file():
        return table_of([])
    signals = read_gmns_signals(told.folder, network, timing_plans=told.timing_plans or None)
    notes.add_table(signals.notes)
    whole = [one for one in signals.plans if one.begin <= 0 and one.end == math.inf]
    for node in dict.fromkeys(one.node_id for one in signals.plans if one not in whole):
        notes.add("signal", f"node {node} has plans by the time of day, which are not read here")
    return table_of(rows_of_signals(whole))


def signals_of(config: Config, path: Path) -> list[Signal]:
    """The signals of a run's network, but for nodes whose signals the configuration describes."""
    from uxsim_geo.network.signal_rows import COLUMNS
    from uxsim_geo.network.signal_table import signals_of_table

    if not path.is_file():
        return []
    import pandas as pd

    texts = {"node_id": "str", "link_id": "str", "source": "str"}
    table = pd.read_csv(path, dtype=texts, keep_default_na=False, na_values={"link_id": [""]})
    own = {entry.node_id for entry in config.simulate.control.signals}
    return signals_of_table(table.loc[~table["node_id"].isin(own), list(COLUMNS)])
