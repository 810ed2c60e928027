"""Two finished runs, compared: what differs in what they were told, and in what came of it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.comparison_files import (
    FOLDER,
    check_place,
    write_folder,
    write_tables,
    write_views,
)
from pipeline.config_differences import Difference, Told, differences, differing_links
from pipeline.finished import check_run, read_run
from pipeline.measure import measure_options, read_measures
from pipeline.runs import RunFolder
from pipeline.table_formats import write_csv
from uxsim_geo.errors import Faults

if TYPE_CHECKING:
    from pipeline.material import Material
    from uxsim_geo.analysis.comparison.comparison import Comparison, Facts
    from uxsim_geo.analysis.comparison.measured import Measured
    from uxsim_geo.export.comparison.study import Study

DIFFERENCES = "config_differences.csv"
#: how it came to what could not be written
ERRORS = "errors.log"


@dataclass(frozen=True)
class ComparedRuns:
    """Two runs side by side.

    a, b
        what they were told
    base, scenario
        their material: that of A, and that of B
    differences
        of their configurations and versions
    warnings
        what corridors and zones a run lacks
    """

    a: Told
    b: Told
    base: Material
    scenario: Material
    comparison: Comparison
    differences: list[Difference]
    warnings: list[str]


def compare_runs(a: Path, b: Path, bin_s: float | None = None) -> ComparedRuns:
    """Compare run B with run A; ``bin_s`` in place of ``measure.bin_s`` of A, s.

    Both are measured as ``measure`` of A's configuration says. Trips are paired by their identity.

    Raises :class:`uxsim_geo.errors.InputError` for folders that hold no finished run, and for runs
    that cannot be compared: of different durations, or of networks without a common link.
    """
    faults = Faults()
    folders = [RunFolder(path) for path in (a, b)]
    manifests = [folder.read_manifest() for folder in folders]
    for folder, manifest in zip(folders, manifests, strict=True):
        check_run(folder, manifest, faults)
    faults.raise_if_any()
    base, scenario = (
        read_run(folder, manifest) for folder, manifest in zip(folders, manifests, strict=True)
    )
    first, second = (
        Told(folder, manifest, material.config)
        for folder, manifest, material in zip(folders, manifests, (base, scenario), strict=True)
    )
    _check_alike(first, second, (base, scenario))
    warnings: list[str] = []
    measured = [_measured(material, first, bin_s, warnings) for material in (base, scenario)]
    return ComparedRuns(
        first,
        second,
        base,
        scenario,
        _compared(first, second, (base, scenario), measured),
        differences(first, second),
        list(dict.fromkeys(warnings)),
    )


def compare_pairs(pairs: Iterable[tuple[RunFolder, RunFolder]], facts: Facts) -> Comparison:
    """Compare measured runs, (base, scenario) of one seed each; two are held at a time.

    Raises :class:`uxsim_geo.errors.InputError` for folders without measures, and for runs that
    cannot be compared.
    """
    from uxsim_geo.analysis.comparison.comparing import compare

    return compare(((read_measures(base), read_measures(other)) for base, other in pairs), facts)


def write_compared_runs(compared: ComparedRuns, path: Path, *, tables_alone: bool) -> list[str]:
    """Write a folder of tables and sentences, and, unless ``tables_alone``, of all that shows them.

    The folder takes its name when it is complete; an earlier comparison there is replaced. Returns
    what could not be written, a line each.
    """
    problems: list[str] = []
    details: list[str] = []

    def write(folder: Path) -> None:
        write_tables([compared.comparison], folder)
        _write_differences(compared.differences, folder / FOLDER / DIFFERENCES)
        if not tables_alone:
            problems.extend(write_views(_as_study(compared), folder, details.append))
        if details:
            (folder / ERRORS).write_text("\n".join(details), encoding="utf-8")

    write_folder(path, write)
    return problems


def place_of(a: Path, b: Path, out: Path | None) -> Path:
    """Where the comparison goes: ``out``, else a folder beside run A, named by both.

    Raises :class:`uxsim_geo.errors.InputError` where something else is in the way.
    """
    first, second = a.resolve(), b.resolve()
    path = out or first.parent / f"{second.name}_against_{first.name}"
    check_place(path)
    return path


def _write_differences(found: list[Difference], path: Path) -> None:
    import pandas as pd

    write_csv(pd.DataFrame(found, columns=list(Difference._fields), dtype="str"), path)


def _as_study(compared: ComparedRuns) -> Study:
    """Two runs as a study of one scenario, whose edits are what differs in the configurations."""
    from pipeline.results_files import describe
    from uxsim_geo.export.comparison.study import Scenario, Study

    facts = compared.comparison.facts
    edits = [str(difference) for difference in compared.differences]
    scenario = Scenario(facts.scenario, edits, compared.scenario.network, compared.comparison)
    about = replace(describe(compared.base), name=f"{facts.scenario} against {facts.base}")
    return Study(about, compared.base.network, [scenario], base_name=facts.base)


def _measured(material: Material, told: Told, bin_s: float | None, warnings: list[str]) -> Measured:
    """Measure a run as another one was told."""
    from uxsim_geo.analysis.comparison.measuring import measure

    section = told.config.measure
    if section.zones is not None:
        section = section.model_copy(update={"zones": (told.folder / str(section.zones)).resolve()})
    if bin_s is not None:
        section = section.model_copy(update={"bin_s": bin_s})
    config = material.config.model_copy(update={"measure": section})
    options = measure_options(config, material.network, warnings)
    return measure(material.result, material.network, options)


def _compared(
    a: Told, b: Told, materials: tuple[Material, Material], measured: list[Measured]
) -> Comparison:
    from uxsim_geo.analysis.comparison.comparing import compare
    from uxsim_geo.analysis.comparison.comparison import Facts

    names = (a.config.name, b.config.name)
    if names[0] == names[1]:
        names = (f"{names[0]} (A)", f"{names[1]} (B)")
    base, scenario = materials
    links = differing_links(a, b, (base.network, scenario.network))
    return compare([(measured[0], measured[1])], Facts(*names, links))


def _check_alike(a: Told, b: Told, materials: tuple[Material, Material]) -> None:
    faults = Faults(f"{a.folder.path} and {b.folder.path}")
    ends = [told.config.simulate.duration_s for told in (a, b)]
    if ends[0] != ends[1]:
        what = f"cannot be compared: the one ends at {ends[0]:g} s, the other at {ends[1]:g} s"
        faults.add(f"{what}; run both with the same simulate.duration_s")
    links = [set(material.network.links["link_id"].astype(str)) for material in materials]
    if not links[0] & links[1]:
        faults.add("cannot be compared: their networks have no link in common, by link_id")
    faults.raise_if_any()
