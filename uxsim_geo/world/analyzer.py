"""What ``W.analyzer`` offers: statistics, tables and figures of a world's result so far."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd

from uxsim_geo.analysis.network_states import network_states
from uxsim_geo.analysis.samples import cells_of_link
from uxsim_geo.analysis.summary import summary
from uxsim_geo.world import pictures, printing, tables
from uxsim_geo.world.figures import Figures


class Analyzer(Figures):
    """Looks at the result of a world up to where its simulation stands.

    States are averages over time bins of the world's ``eular_dt``. Raises RuntimeError before
    anything has been simulated.
    """

    def print_simple_stats(self, force_print: bool = False) -> None:
        """Print the main figures; without ``print_mode`` only if forced."""
        if self.W.print_mode or force_print:
            printing.print_statistics(self.statistics())

    def statistics(self) -> dict[str, Any]:
        """Return the figures of the run so far: :func:`uxsim_geo.analysis.summary.summary`."""
        return summary(self._result, self._network)

    def basic_to_pandas(self) -> pd.DataFrame:
        """One row of figures: :func:`uxsim_geo.world.tables.basic_table`."""
        return tables.basic_table(self.statistics())

    def od_to_pandas(self) -> pd.DataFrame:
        """One row a pair: :func:`uxsim_geo.world.tables.od_table`."""
        return tables.od_table(self._network, self._result)

    def link_to_pandas(self) -> pd.DataFrame:
        """One row a link: :func:`uxsim_geo.world.tables.link_table`."""
        return tables.link_table(self._network, self._result)

    def mfd_to_pandas(self) -> pd.DataFrame:
        """One row a time bin: :func:`uxsim_geo.world.tables.mfd_table`."""
        return tables.mfd_table(network_states(self._states, self._network))

    def vehicle_trip_to_pandas(self) -> pd.DataFrame:
        """One row a platoon: :func:`uxsim_geo.world.tables.trip_table`."""
        return tables.trip_table(self._result)

    def vehicles_to_pandas(self) -> pd.DataFrame:
        """Where every platoon was at every time step: link, x (m from its start), v (m/s)."""
        return tables.sample_table(self._network, self._result, self._passages, self._samples)

    def link_traffic_state_to_pandas(self) -> pd.DataFrame:
        """Flow (veh/s), density (veh/m) and speed (m/s) by link, time bin and tenth of the link."""
        rows = [
            tables.cell_table(
                link.name, cells_of_link(self._passages, self._samples, link.id, edges)
            )
            for link in self.W.LINKS
            if (edges := self._cell_edges(link))
        ]
        return pd.concat(rows, ignore_index=True)

    def output_data(self, fname: str | None = None) -> None:
        """Write all tables to CSV files whose names begin with ``fname``."""
        begin = Path(fname) if fname is not None else pictures.folder(self.W) / "data"
        begin.parent.mkdir(parents=True, exist_ok=True)
        for name, table in (
            ("basic", self.basic_to_pandas()),
            ("od", self.od_to_pandas()),
            ("mfd", self.mfd_to_pandas()),
            ("link", self.link_to_pandas()),
            ("link_traffic_state", self.link_traffic_state_to_pandas()),
            ("vehicles", self.vehicles_to_pandas()),
        ):
            table.to_csv(begin.with_name(f"{begin.name}_{name}.csv"), index=False)
