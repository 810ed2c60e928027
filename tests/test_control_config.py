"""Control in a configuration: what each key makes, and how every fault is said."""

from __future__ import annotations

from pathlib import Path

import pytest
from conftest import REPOSITORY
from small_run import CONFIG, write_small_run

from pipeline.config import Config
from pipeline.config_file import load_config, write_config
from pipeline.control_config_faults import as_written
from uxsim_geo.control.capacity import LinkCapacity, NodeCapacity
from uxsim_geo.control.closures import Closure, Incident
from uxsim_geo.control.drivers import DriverClass
from uxsim_geo.control.guidance import Advice, EnforcedRoute
from uxsim_geo.control.metering import Feedback, RampMeter
from uxsim_geo.control.perimeter import Perimeter
from uxsim_geo.control.priorities import MergePriority
from uxsim_geo.control.signals import Phase, Signal
from uxsim_geo.control.site import Target
from uxsim_geo.control.speed_limits import SpeedLimit
from uxsim_geo.control.tolls import CongestionToll, Toll
from uxsim_geo.errors import Fault, InputError

#: the first line of what is put below ``simulate`` in the small configuration
FIRST = CONFIG[: CONFIG.index("report:")].count("\n") + 1

A, B = Target(("1-3",)), Target(("3-4", "4-2"))


def with_simulate(text: str) -> str:
    """The small configuration with more lines in section ``simulate``."""
    return CONFIG.replace("report:", text + "report:")


def with_control(text: str) -> str:
    lines = "".join(f"    {line}\n" for line in text.strip("\n").split("\n"))
    return with_simulate(f"  control:\n{lines}")


def measures_of(folder: Path, text: str) -> list[object]:
    config = load_config(write_small_run(folder, with_control(text)))
    return [entry.measure() for _, _, entry in config.simulate.control.entries()]


def faults_of(folder: Path, config: str) -> list[str]:
    path = write_small_run(folder, config)
    with pytest.raises(InputError) as caught:
        load_config(path)
    return [str(fault).replace(f"{folder}/", "") for fault in caught.value.faults]


def only_fault(folder: Path, config: str) -> str:
    (fault,) = faults_of(folder, config)
    return fault


LEAST = {
    "signals: [{node_id: 3, phases: [{duration_s: 30, links: [1-3]}]}]": Signal(
        "3", (Phase(30, ("1-3",)),)
    ),
    "ramp_meters: [{links: [1-3], rate_veh_per_h: 720}]": RampMeter(A, 0.2),
    "ramp_meters: [{links: [1-3], feedback: {measured: {links: [3-4, 4-2]}, "
    "target_density_veh_per_km: 30}}]": RampMeter(A, None, Feedback(B, 0.03)),
    "perimeters: [{region: {links: [3-4, 4-2]}, target_vehicles: 80}]": Perimeter(
        B, target_vehicles=80
    ),
    "link_capacities: [{links: [1-3], exit_veh_per_h: 720}]": LinkCapacity(A, 0.2),
    "node_capacities: [{nodes: [3], capacity_veh_per_h: 720}]": NodeCapacity(("3",), 0.2),
    "tolls: [{links: [1-3], amount: 2.5}]": Toll(A, 2.5),
    "congestion_tolls: [{links: [1-3], target_density_veh_per_km: 30, gain: 0.01, "
    "max_amount: 5}]": CongestionToll(A, 0.03, 10.0, 5.0),
    "closures: [{links: [1-3]}]": Closure(A),
    "incidents: [{links: [1-3], lanes_closed: 1}]": Incident(A, 1),
    "speed_limits: [{links: [1-3], speed_kmh: 36}]": SpeedLimit(A, 10.0),
    "merge_priorities: [{links: [1-3], priority: 2}]": MergePriority(A, 2),
    "advice: [{links: [1-3], seconds: -30}]": Advice(A, -30),
    "enforced_routes: [{origin: 1, destination: 4, links: [1-3, 3-4]}]": EnforcedRoute(
        "1", "4", ("1-3", "3-4")
    ),
}


@pytest.mark.parametrize("text", LEAST)
def test_the_least_one_can_write_makes_the_measure_with_its_own_defaults(
    tmp_path: Path, text: str
) -> None:
    assert measures_of(tmp_path, text) == [LEAST[text]]


def test_every_kind_of_measure_is_tried_here() -> None:
    control = Config.model_fields["simulate"].annotation.model_fields["control"].annotation
    assert {text.partition(":")[0] for text in LEAST} == set(control.model_fields)


FULL = {
    """
signals:
  - node_id: "3"
    phases:
      - {duration_s: 30, links: [1-3]}
      - {duration_s: 20, links: [4-3]}
    offset_s: 5
    all_red_s: 2
    begin_s: 60
    end_s: 600
""": Signal("3", (Phase(30, ("1-3",)), Phase(20, ("4-3",))), 5, 2, 60, 600),
    """
ramp_meters:
  - where: lanes >= 2
    polygon: POLYGON ((0 0, 1 0, 1 1, 0 0))
    polygon_part: entering
    rate_veh_per_h: [[0, 360], [900, 720]]
    end_s: 1000
""": RampMeter(
        Target((), "lanes >= 2", "POLYGON ((0 0, 1 0, 1 1, 0 0))", "entering"),
        ((0, 0.1), (900, 0.2)),
        end=1000,
    ),
    """
ramp_meters:
  - links: [1-3]
    feedback:
      measured: {links: [3-4, 4-2]}
      target_density_veh_per_km: 40
      gain: 36
      min_rate_veh_per_h: 360
      max_rate_veh_per_h: 1800
      interval_s: 30
""": RampMeter(A, None, Feedback(B, 0.04, 10.0, 0.1, 0.5, 30)),
    """
perimeters:
  - region: {links: [3-4, 4-2]}
    gates: {links: [1-3]}
    flow_veh_per_h: 1800
    gain: 7.2
    damping: 3.6
    min_flow_veh_per_h: 360
    max_flow_veh_per_h: 3600
    interval_s: 30
    begin_s: 60
""": Perimeter(B, A, None, 0.5, 0.002, 0.001, 0.1, 1.0, 30, 60),
    """
link_capacities:
  - links: [1-3]
    entry_veh_per_h: [[0, 360], [60, 720]]
    begin_s: 10
""": LinkCapacity(A, None, ((0, 0.1), (60, 0.2)), 10),
    """
congestion_tolls:
  - links: [1-3]
    target_density_veh_per_km: 30
    gain: 0.02
    min_amount: 1
    max_amount: 5
    interval_s: 120
""": CongestionToll(A, 0.03, 20.0, 5, 1, 120),
    """
closures:
  - {links: [1-3], begin_s: 60, end_s: 90, on_link: stay}
  - {links: [1-3], classes: [lorries]}
""": [Closure(A, 60, 90, "stay"), Closure(A, classes=("lorries",))],
    """
advice:
  - {links: [1-3], seconds: [[0, 30], [60, -30]], classes: [lorries], begin_s: 5}
enforced_routes:
  - {origin: 1, destination: 4, links: [1-3, 3-4], share: 0.5, classes: [lorries], end_s: 60}
""": [
        Advice(A, ((0, 30), (60, -30)), ("lorries",), 5),
        EnforcedRoute("1", "4", ("1-3", "3-4"), 0.5, ("lorries",), 0, 60),
    ],
}


@pytest.mark.parametrize("text", FULL)
def test_peoples_units_become_si(tmp_path: Path, text: str) -> None:
    made, expected = measures_of(tmp_path, text), FULL[text]
    expected = expected if isinstance(expected, list) else [expected]
    assert [type(one) for one in made] == [type(one) for one in expected]
    assert [numbers_of(one) for one in made] == [numbers_of(one) for one in expected]


def numbers_of(value: object) -> object:
    """The same with all floats rounded, since 36 / 3.6 is not always 10."""
    if isinstance(value, bool | int | float):
        return round(float(value), 12)
    if isinstance(value, tuple):
        return tuple(map(numbers_of, value))
    fields = getattr(value, "__dataclass_fields__", None)
    if fields is None:
        return value
    return {name: numbers_of(getattr(value, name)) for name in fields}


def test_classes_of_drivers(tmp_path: Path) -> None:
    text = """  classes:
    - name: plain
    - name: lorries
      value_of_time_per_h: 40
      distance_cost_per_km: 0.5
      toll_factor: 2
      informed_share: 0.7
      information_interval_s: 300
      information_delay_s: 60
      compliance: 0.9
      banned: {links: [3-4]}
"""
    config = load_config(write_small_run(tmp_path, with_simulate(text)))
    assert [entry.driver_class() for entry in config.simulate.classes] == [
        DriverClass("plain"),
        DriverClass("lorries", 40, 0.5, 2, 0.7, 300, 60, 0.9, Target(("3-4",))),
    ]


def test_trips_of_classes_that_nobody_describes_and_classes_given_twice(tmp_path: Path) -> None:
    text = with_simulate("  classes: [{name: cars}, {name: cars}]\n")
    faults = faults_of(
        tmp_path, text.replace("demand_period_s", "class: vans\n    demand_period_s")
    )
    assert faults == [
        f"small.yaml:{FIRST + 1}: simulate.classes[1].name: there is a class of this name above; "
        "give each its own (found 'cars')",
        "small.yaml:7: ingest.trips.class: simulate.classes does not describe it; there are cars, "
        "default (found 'vans')",
    ]


def test_trips_may_name_the_default_class(tmp_path: Path) -> None:
    config = CONFIG.replace("demand_period_s", "class: default\n    demand_period_s")
    assert load_config(write_small_run(tmp_path, config)).ingest.trips[0].driver_class == "default"


@pytest.mark.parametrize(
    ("text", "line", "expected"),
    [
        (
            "tolls: [{amount: 1}]",
            1,
            "tolls[0]: says of no link; give links, where, polygon or street",
        ),
        ("tolls:\n- links: [a]\n  amont: 1", 2, "control.tolls[0].amount is missing"),
        ("tolls:\n- links: [a]\n  amount: 1\n  end: 3", 4, "did you mean simulate.control.tolls."),
        ("toll: []", 1, "unknown key simulate.control.toll; did you mean simulate.control.tolls?"),
        ("tolls:\n- links: a\n  amount: 1", 2, "tolls[0].links: must be a list, as [a, b]"),
        ("tolls:\n- links: [007]\n  amount: 1", 2, "write the id in quotes"),
        ("tolls:\n- links: [a, true]\n  amount: 1", 2, "tolls[0].links[1]: YAML takes this for"),
        ("tolls:\n- links: [a]\n  amount: dear", 3, "tolls[0].amount: must be a finite number, or"),
        ("tolls:\n- links: [a]\n  amount: [0, 5]", 3, "or pairs [from_s, number], as [[0, 5]"),
        ("tolls:\n- links: [a]\n  amount: []", 3, "must be a finite number, or pairs"),
        ("tolls:\n- links: [a]\n  amount: [[0, .nan]]", 3, "must be a finite number, or pairs"),
        ("tolls:\n- polygon: here.gpkg\n  amount: 1", 2, "polygon: no such file (looked for"),
        ("tolls:\n- polygon: .\n  amount: 1", 2, "polygon: is a folder"),
        ("tolls:\n- polygon: 5\n  amount: 1", 2, "must be the path of a GeoJSON or GeoPackage"),
        ("tolls:\n- links: [a]\n  polygon_part: inside\n  amount: 1", 2, "needs a polygon"),
        (
            "tolls:\n- links: [a]\n  begin_s: soon\n  amount: 1",
            3,
            "begin_s: must be a valid number",
        ),
        ("closures:\n- links: [a]\n  on_link: go", 3, "must be 'clear' or 'stay'"),
        ("signals: [{node_id: 3}]", 1, "signals[0].phases is missing"),
        ("signals: {node_id: 3}", 1, "signals: must be a list, as [a, b]"),
        ("incidents:\n- links: [a]\n  lanes_closed: 0.5", 3, "must be a valid integer"),
    ],
)
def test_wrong_value_is_named_with_its_line(
    tmp_path: Path, text: str, line: int, expected: str
) -> None:
    faults = faults_of(tmp_path, with_control(text))
    (fault,) = (one for one in faults if expected in one)
    assert fault.startswith(f"small.yaml:{FIRST + line}: ")


def test_a_control_file_is_taken_in(tmp_path: Path) -> None:
    shared = tmp_path / "shared"
    shared.mkdir()
    (shared / "area.geojson").write_text("{}")
    (shared / "rules.yaml").write_text("tolls:\n- polygon: area.geojson\n  amount: 2\n")
    config = load_config(write_small_run(tmp_path, with_simulate("  control: shared/rules.yaml\n")))
    (toll,) = config.simulate.control.tolls
    assert toll.target().polygon == str(shared / "area.geojson")
    assert config.simulate.control.origin(("simulate", "control", "tolls", 0, "amount")) == (
        str(shared / "rules.yaml"),
        3,
    )


def test_faults_of_a_control_file_come_with_its_lines_beside_those_of_the_configuration(
    tmp_path: Path,
) -> None:
    (tmp_path / "rules.yaml").write_text("tolls:\n- links: [a]\n  amount: much\nclosure: []\n")
    config = with_simulate("  control: rules.yaml\n").replace("1200", "soon")
    faults = faults_of(tmp_path, config)
    assert [fault.partition(" simulate")[0] for fault in faults] == [
        "rules.yaml:3:",
        "rules.yaml:4: unknown key",
        "small.yaml:13:",
    ]


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ("nowhere.yaml", "simulate.control: no such file (looked for"),
        (".", "simulate.control: is a folder; name a file in it"),
        ("5", "simulate.control: must be a section (keys and values), or the path"),
        ("[a]", "simulate.control: must be a section (keys and values), or the path"),
        ("net.tntp", "net.tntp: must hold lines of the form"),
    ],
)
def test_control_that_is_neither_section_nor_file(
    tmp_path: Path, value: str, expected: str
) -> None:
    fault = only_fault(tmp_path, with_simulate(f"  control: {value}\n"))
    assert expected in fault
    assert fault.startswith(f"small.yaml:{FIRST}: " if "simulate" in expected else "net.tntp")


def test_an_edit_may_name_another_control_file(tmp_path: Path) -> None:
    (tmp_path / "rules.yaml").write_text("tolls: [{links: [1-3], amount: 2}]\n")
    config = load_config(write_small_run(tmp_path), ["simulate.control=rules.yaml"])
    assert len(config.simulate.control.tolls) == 1
    path = write_small_run(tmp_path, with_control("tolls: [{links: [1-3], amount: 2}]"))
    edited = load_config(path, ["simulate.control.tolls.0.amount=[[0, 1], [60, 2]]"])
    assert edited.simulate.control.tolls[0].amount == ((0.0, 1.0), (60.0, 2.0))


def test_the_resolved_configuration_holds_all_of_it(tmp_path: Path) -> None:
    (tmp_path / "area.geojson").write_text("{}")
    text = "".join(f"{one}\n" for one in LEAST if "feedback" not in one)
    text += "speed_limits: [{polygon: area.geojson, speed_kmh: [[0, 30], [60, 50]]}]\n"
    text = text.replace(next(one for one in LEAST if "speed" in one) + "\n", "")
    config = load_config(write_small_run(tmp_path, with_control(text)))
    resolved = tmp_path / "elsewhere" / "config.yaml"
    resolved.parent.mkdir()
    write_config(config, resolved)
    assert load_config(resolved) == config
    assert "polygon: ../area.geojson" in resolved.read_text()


CONTROL = """
signals:
  - node_id: 3
    phases:
      - {duration_s: 30, links: [1-3]}
      - duration_s: -5
        links: [4-3]
closures:
  - links: [zz]
    begin_s: 60
  - where: lanes > 9
ramp_meters:
  - links: [1-3]
    rate_veh_per_h: [[0, 9000], [60, 36000]]
  - links: [1-3]
    feedback:
      measured: {links: [zz]}
      target_density_veh_per_km: 30
      min_rate_veh_per_h: 36000
"""


@pytest.mark.parametrize(
    ("fault", "line", "expected"),
    [
        (
            Fault("must last", "control", 1, "duration", -5.0),
            5,
            "signals[0].phases[1].duration_s: must last (found '-5')",
        ),
        (
            Fault("no such node", "control", 1, "node", "3"),
            2,
            "signals[0].node_id: no such node (found '3')",
        ),
        (
            Fault("changes nothing: 0.8 veh/s at most; is it veh/s?", "control", 2, "rate", 2.5),
            13,
            "ramp_meters[0].rate_veh_per_h: changes nothing: 2880 veh/h at most; is it veh/h? "
            "(found '[[0, 9000], [60, 36000]]')",
        ),
        (
            Fault("above 20 m/s, 0.2 veh/m, 1e-05 veh/s", "control", 3, "min_rate", 10.0),
            18,
            "feedback.min_rate_veh_per_h: above 72 km/h, 200 veh/km, 0.036 veh/h (found '36000')",
        ),
        (
            Fault("no link is meant", "control", 3, "measured", "zz"),
            16,
            "ramp_meters[1].feedback.measured: no link is meant (found 'zz')",
        ),
        (
            Fault("no such link", "control", 4, "links", "zz"),
            8,
            "closures[0].links: no such link (found 'zz')",
        ),
        (Fault("too late", "control", 4, "begin", 60.0), 9, "begin_s: too late (found '60')"),
        (Fault("nothing", "control", 5, "links", "lanes > 9"), 10, "closures[1].where: nothing"),
        (Fault("sets it too", "control", 5), 10, "simulate.control.closures[1]: sets it too"),
    ],
)
def test_what_the_library_finds_is_said_in_the_words_of_the_file(
    tmp_path: Path, fault: Fault, line: int, expected: str
) -> None:
    config = load_config(write_small_run(tmp_path, with_control(CONTROL)))
    (told,) = as_written([fault], config.simulate)
    assert told.line == FIRST + line
    assert expected in str(told).replace(f"{tmp_path}/", "")
    assert told.source == str(tmp_path / "small.yaml")


def test_faults_of_classes_and_of_other_inputs(tmp_path: Path) -> None:
    text = "  classes:\n    - name: a\n      banned: {links: [zz]}\n"
    config = load_config(write_small_run(tmp_path, with_simulate(text)))
    of_class = Fault("no such link", "classes", 1, "banned", "zz")
    other = Fault("is cut", "links.parquet")
    told = as_written([of_class, other], config.simulate)
    expected = "simulate.classes[0].banned: no such link"
    assert told == [Fault(expected, str(tmp_path / "small.yaml"), FIRST + 2, None, "zz"), other]


def test_classes_that_make_no_sense_are_refused_with_their_lines(tmp_path: Path) -> None:
    text = "  classes:\n    - name: a\n      compliance: 2\n      value_of_time_per_h: 0\n"
    faults = faults_of(tmp_path, with_simulate(text))
    assert [fault.partition(" must")[0] for fault in faults] == [
        f"small.yaml:{FIRST + 2}: simulate.classes[0].compliance:",
        f"small.yaml:{FIRST + 3}: simulate.classes[0].value_of_time_per_h:",
    ]


def fields_of(measure: object) -> set[str]:
    """Names of the fields of a measure and of what it holds."""
    found = set()
    for name in getattr(measure, "__dataclass_fields__", ()):
        value = getattr(measure, name)
        found |= {name} | (fields_of(value) if not isinstance(value, Target) else set())
        found |= fields_of(value[0]) if isinstance(value, tuple) and value else set()
    return found


@pytest.mark.parametrize("text", LEAST)
def test_every_field_that_the_library_may_find_wrong_has_its_key(tmp_path: Path, text: str) -> None:
    config = load_config(write_small_run(tmp_path, with_control(text)))
    for name in fields_of(LEAST[text]):
        (told,) = as_written([Fault("is wrong", "control", 1, name)], config.simulate)
        assert told.what.partition(": ")[0].rpartition(".")[2].startswith(name)


def test_measures_that_the_library_numbers_are_named_by_their_place(tmp_path: Path) -> None:
    config = load_config(write_small_run(tmp_path, with_control(CONTROL)))
    what = "sets the exit capacity that measure 2 (ramp meter on link 1-3) sets too"
    (told,) = as_written([Fault(what, "control", 3)], config.simulate)
    place = f"simulate.control.ramp_meters[0], line {FIRST + 12} (ramp meter"
    assert told.what.startswith("simulate.control.ramp_meters[1]: sets the exit capacity that ")
    assert place in told.what


def test_the_examples_of_gridlock_differ_in_control_only() -> None:
    folder = REPOSITORY / "configs"
    base = load_config(folder / "gridlock.yaml")
    cures = sorted(folder.glob("gridlock_*.yaml"))
    for path in (one for one in cures if one.stem != "gridlock_prevented"):
        cured = load_config(path)
        assert list(cured.simulate.control.entries())
        simulate = cured.simulate.model_copy(update={"control": base.simulate.control})
        assert (cured.ingest, simulate, cured.report) == (base.ingest, base.simulate, base.report)
