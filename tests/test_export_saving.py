"""Figures as files: formats by the ending, and the same bytes for the same figure."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import pytest
from mapped_network import states_with_a_queue, two_way_road
from matplotlib.figure import Figure

from uxsim_geo.analysis.link_states import link_totals
from uxsim_geo.errors import InputError
from uxsim_geo.export.plots import network_state_figure
from uxsim_geo.export.saving import save_figure

BEGINS = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}
TELLTALES = (b"Software", b"Matplotlib", b"matplotlib.org", b"Date", b"<dc:date>", b"Producer")


def state_figure() -> Figure:
    network = two_way_road()
    return network_state_figure(network, link_totals(states_with_a_queue(network)), "t")


@pytest.mark.parametrize("ending", BEGINS)
def test_a_file_depends_on_nothing_but_the_figure(ending: str, tmp_path: Path) -> None:
    one, two, again = (tmp_path / f"{name}{ending}" for name in ("one", "two", "again"))
    figure = state_figure()
    save_figure(figure, one)
    save_figure(figure, again)
    save_figure(state_figure(), two)
    assert one.read_bytes() == two.read_bytes() == again.read_bytes()
    assert one.read_bytes().startswith(BEGINS[ending])
    assert not [telltale for telltale in TELLTALES if telltale in one.read_bytes()]


def test_capital_endings_are_endings(tmp_path: Path) -> None:
    save_figure(state_figure(), tmp_path / "MAP.SVG")
    assert (tmp_path / "MAP.SVG").read_bytes().startswith(BEGINS[".svg"])


def test_other_figures_keep_their_settings(tmp_path: Path) -> None:
    before = mpl.rcParams["svg.hashsalt"]
    save_figure(state_figure(), tmp_path / "map.svg")
    assert mpl.rcParams["svg.hashsalt"] == before


@pytest.mark.parametrize("name", ["map.jpg", "map"])
def test_another_format_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.png, \.svg or \.pdf") as refused:
        save_figure(state_figure(), tmp_path / name)
    assert refused.value.faults[0].value == name
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("ending", ["png", "svg", "pdf"])
def test_names_with_dollars_are_no_formulas(ending: str, tmp_path: Path) -> None:
    name = r"US$ \frac{$ and A$_^$"
    figure = Figure(layout="constrained")
    axes = figure.subplots()
    axes.plot([0, 1], label=name)
    axes.set(title=name, xlabel=name, xticks=[0, 1], xticklabels=[name, name])
    axes.annotate(name, (0, 0))
    axes.legend(title=name)
    figure.suptitle(name)
    save_figure(figure, tmp_path / f"plot.{ending}")
    if ending == "svg":
        assert (tmp_path / "plot.svg").read_text().count(f"<!-- {name} -->") == 8
