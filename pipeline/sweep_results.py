"""What came of a sweep: one tidy table of its runs, and plots against every parameter."""

from __future__ import annotations

import csv
import io
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.scenarios import BASE
from pipeline.study_jobs import NAMES, Report
from pipeline.sweep_config import SweepSection
from uxsim_geo.analysis.comparison.quantities import TOTALS
from uxsim_geo.files import replace_when_complete

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: in the folder of a study
SWEEP = "sweep.csv"
PLOTS = "plots"


@dataclass(frozen=True)
class SweepRuns:
    """A sweep and the runs of its study, those of the base among them."""

    section: SweepSection
    reports: Sequence[Report]

    @cached_property
    def points(self) -> dict[str, dict[str, Any]]:
        """The parameters of each point, by its name."""
        return self.section.points()

    @property
    def of_points(self) -> list[Report]:
        """The runs of the points."""
        return [report for report in self.reports if report.scenario in self.points]

    def write(self, folder: Path) -> list[str]:
        """Write the table, and a plot a figure; return their names in the folder."""
        with replace_when_complete(folder / SWEEP) as path:
            path.write_text(self.table(), encoding="utf-8")
        names = [SWEEP]
        if any(report.status == "finished" for report in self.of_points):
            from uxsim_geo.export.saving import save_figure

            (folder / PLOTS).mkdir(exist_ok=True)
            for figure in self.section.figures:
                names.append(f"{PLOTS}/sweep_{figure}.png")
                save_figure(self.plot(figure), folder / names[-1])
        return names

    def table(self) -> str:
        """Return a CSV table: point, seed, status, all parameters, all figures, a row a run."""
        text = io.StringIO()
        rows = csv.writer(text, lineterminator="\n")
        parameters = self.section.parameters
        rows.writerow(("point", "seed", "status", *parameters, *NAMES))
        for report in self.of_points:
            values = (self.points[report.scenario][name] for name in parameters)
            figures = (report.figures.get(name) for name in NAMES)
            cells = ("" if value is None else value for value in (*values, *figures))
            rows.writerow((report.scenario, report.seed, report.status, *cells))
        return text.getvalue()

    def plot(self, figure: str) -> Figure:
        """Draw a figure of the finished runs against every parameter."""
        import pandas as pd

        from uxsim_geo.export.sweep_plots import sweep_figure

        rows = [
            {"point": one.scenario, **self.points[one.scenario], figure: one.figures.get(figure)}
            for one in self.of_points
            if one.status == "finished"
        ]
        (quantity,) = (one for one in TOTALS if one.name == figure)
        label = f"{quantity.title}, {quantity.unit}" if quantity.unit else quantity.title
        runs = pd.DataFrame(rows).astype({figure: float})
        parameters = self.section.parameters
        return sweep_figure(runs, parameters, figure, label=label, base=self._base_mean(figure))

    def _base_mean(self, figure: str) -> float | None:
        values = [
            value
            for report in self.reports
            if report.scenario == BASE and (value := report.figures.get(figure)) is not None
        ]
        return statistics.fmean(values) if values else None
