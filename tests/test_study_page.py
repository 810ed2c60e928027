"""``comparison.html`` as text: what it says, and that nothing of a study becomes code."""

from __future__ import annotations

import base64
import gzip
import json
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from compared import example_comparison
from shown_study import EVIL, study

from uxsim_geo.export.comparison.document import ABSENT, IN_TIME, KINDS, WHOLE, parts_of
from uxsim_geo.export.comparison.page import page
from uxsim_geo.export.page.packing import packed_numbers


def unpacked(text: str) -> np.ndarray:
    """Numbers of packed_numbers, put together again byte by byte."""
    planes = np.frombuffer(gzip.decompress(base64.b64decode(text)), np.uint8).reshape(3, -1)
    bits = sum(plane.astype("<u4") << np.uint32(8 * (at + 1)) for at, plane in enumerate(planes))
    return np.asarray(bits, "<u4").view("<f4")


class Text(HTMLParser):
    """All text that a reader sees, and the tags."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.words: list[str] = []
        self.tags: list[str] = []
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: object) -> None:  # noqa: ARG002
        self.tags.append(tag)

    def handle_data(self, data: str) -> None:
        if self.tags[-1:] not in (["script"], ["style"]):
            self.words.append(data)

    @property
    def said(self) -> str:
        return re.sub(r"\s+", " ", " ".join(self.words))


def test_packed_numbers_keep_their_size_and_what_is_none() -> None:
    values = np.array([0.0, -0.001, np.pi, -1e9, np.nan, 65535.5, 1e-30])
    found = unpacked(packed_numbers(values))
    np.testing.assert_allclose(found, values, rtol=2.0**-16)
    assert np.isnan(found).tolist() == np.isnan(values).tolist()
    assert found[0] == 0.0


def test_numbers_of_links_are_those_of_the_comparison() -> None:
    parts = parts_of(study())
    content = json.loads(gzip.decompress(base64.b64decode(parts["document"])))
    table = example_comparison(4)[2].links
    assert content["links"]["ids"] == table["link_id"].tolist()
    assert content["scenarios"][0]["kinds"] == [KINDS[one] for one in table["exists"]]
    # a link that the other scenario adds is not there at all
    assert content["scenarios"][1]["kinds"] == 6 * [KINDS["both"]] + [ABSENT]
    whole = unpacked(parts["whole-0-0"]).reshape(-1, len(WHOLE))
    for at, field in enumerate(("base", "scenario", "difference")):
        np.testing.assert_allclose(
            whole[:, at], table[f"delay_veh_h_{field}"], rtol=1e-4, atol=1e-9
        )
    low, high = (table[f"delay_veh_h_{end}"] for end in ("low", "high"))
    np.testing.assert_allclose(2 * whole[:, 3], high - low, rtol=1e-4, atol=1e-9)
    times = unpacked(parts["time-0-0"]).reshape(len(table), 6, len(IN_TIME))
    expected = example_comparison(4)[2].link_times
    for at, field in enumerate(("base", "scenario")):
        told = expected[f"delay_veh_h_{field}"]
        np.testing.assert_allclose(times[:, :, at].ravel(), told, rtol=1e-4, atol=1e-9)
    half = (expected["delay_veh_h_high"] - expected["delay_veh_h_low"]) / 2
    np.testing.assert_allclose(times[:, :, 2].ravel(), half, rtol=1e-4, atol=1e-9)


def test_both_sides_without_a_pair_of_runs_that_has_both_are_no_difference() -> None:
    whole = study()
    found = example_comparison(4)[2]
    times = found.link_times.copy()
    times.loc[0, ["delay_veh_h_base", "delay_veh_h_scenario"]] = 1.0, 2.0
    times.loc[0, [f"delay_veh_h_{end}" for end in ("difference", "low", "high")]] = np.nan
    entry = whole.scenarios[0]._replace(comparison=replace(found, link_times=times))
    parts = parts_of(replace(whole, scenarios=[entry]))
    assert unpacked(parts["time-0-0"])[: len(IN_TIME)].tolist() == [1.0, 2.0, np.inf]


def test_names_of_all_kinds_come_out_as_text() -> None:
    html = page(study())
    for evil in (EVIL[1], EVIL[2]):
        assert evil not in html
    told = Text(html)
    for evil in EVIL:
        assert re.sub(r"\s+", " ", evil) in told.said
    assert "img" in told.tags
    assert told.tags.count("img") == 1  # that of the printed map
    assert "{{ harm }}" in told.said


def test_question_and_answer_stand_before_all_figures() -> None:
    said = Text(page(study())).said
    places = [said.index(words) for words in ("What was asked", "The answer", "Figures of all")]
    assert places == sorted(places)
    assert "add link bc" in said[places[0] : places[1]]
    assert "Total delay falls by " in said[places[1] : places[2]]
    assert "Nothing changes" in said[places[1] : places[2]]


def test_failed_runs_are_told_and_what_could_not_be_compared() -> None:
    said = Text(page(study())).said
    assert "2 runs failed and are not in these figures" in said
    assert "No pair of runs came to its end" in said
    assert f"no way: {EVIL[1]}" in said


def test_corridors_of_one_network_alone_are_not_compared() -> None:
    said = Text(page(study())).said
    assert "It exists in the base alone: there is nothing to compare." in said


@pytest.mark.parametrize("kind", ["one seed", "nothing", "no comparison", "no scenario"])
def test_there_is_a_page_of_whatever_there_is(kind: str) -> None:
    shown = study(1 if kind == "one seed" else 2)
    chosen = {"nothing": shown.scenarios[1:2], "no comparison": shown.scenarios[2:]}
    scenarios = [] if kind == "no scenario" else chosen.get(kind, shown.scenarios)
    failed = shown.failed if kind == "one seed" else ()
    said = Text(page(replace(shown, scenarios=scenarios, failed=failed))).said
    expected = {
        "one seed": "One pair of runs",
        "nothing": "No figure differs in any scenario",
        "no comparison": "Nothing could be compared",
        "no scenario": "There is no scenario",
    }
    assert expected[kind] in said
    assert "nan" not in re.sub(r"(?i)[a-z]nan|nan[a-z]", "", said)


def test_the_same_study_gives_the_same_page() -> None:
    assert page(study()) == page(study())
