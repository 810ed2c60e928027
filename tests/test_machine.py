"""What a run may use of the machine, and that it is told before it takes more."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from small_networks import across, grid, network
from test_engine_order import hash_of

from pipeline.allowance import allowed_machine
from uxsim_geo.engine.simulation import Simulation, simulate
from uxsim_geo.errors import InputError
from uxsim_geo.machine import Machine, free_memory
from uxsim_geo.settings import Settings


def system(root: Path, files: dict[str, str]) -> Path:
    """The files of a system that has them."""
    for name, text in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="ascii")
    return root


AVAILABLE = {"proc/meminfo": "MemTotal: 9000 kB\nMemAvailable: 8000 kB\n"}
#: a group of version 2 that has 3,000,000 bytes left, in one that has 5,000,000
GROUPS = {
    "proc/self/cgroup": "0::/outer/inner\n",
    "sys/fs/cgroup/outer/memory.max": "9000000\n",
    "sys/fs/cgroup/outer/memory.current": "4000000\n",
    "sys/fs/cgroup/outer/inner/memory.max": "6000000\n",
    "sys/fs/cgroup/outer/inner/memory.current": "4000000\n",
    "sys/fs/cgroup/outer/inner/memory.stat": "anon 3000000\ninactive_file 1000000\n",
}
#: of version 1, with 2,000,000 bytes left
OLD_GROUPS = {
    "proc/self/cgroup": "5:cpu:/x\n4:memory:/x\n",
    "sys/fs/cgroup/memory/x/memory.limit_in_bytes": "3000000\n",
    "sys/fs/cgroup/memory/x/memory.usage_in_bytes": "1000000\n",
}
UNLIMITED = GROUPS | {f"sys/fs/cgroup/{group}/memory.max": "max\n" for group in ("outer/inner",)}


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        (AVAILABLE, 8_192_000),
        (AVAILABLE | GROUPS, 3_000_000),
        (AVAILABLE | UNLIMITED, 5_000_000),
        (AVAILABLE | OLD_GROUPS, 2_000_000),
        (AVAILABLE | {"proc/self/cgroup": "0::/\n"}, 8_192_000),
        (AVAILABLE | {"proc/self/cgroup": "nonsense\n"}, 8_192_000),
    ],
)
def test_free_memory_is_what_the_system_says(
    files: dict[str, str], expected: float, tmp_path: Path
) -> None:
    assert free_memory(system(tmp_path, files)) == expected


def test_other_systems_are_asked_for_all_they_have(tmp_path: Path) -> None:
    assert free_memory(tmp_path) > 1e8


def test_a_run_that_would_not_fit_is_told_before() -> None:
    case = network(grid(20)), across(20, 0.1, 100.0), Settings(1000, 5)
    with pytest.raises(InputError) as error:
        Simulation(*case, machine=Machine(memory_gb=1e-4))
    (fault,) = error.value.faults
    assert "GB of memory, and 0.0001 GB are free: " in fault.what
    assert "UXSIM_GEO_MEMORY_GB" in fault.what


def test_what_is_needed_is_told_by_its_parts() -> None:
    """76 destinations make two batches, of 64 bytes for each of 1,520 links."""
    from uxsim_geo.engine.memory import check_memory, memory_needs

    run = Simulation(network(grid(20)), across(20, 0.1, 100.0), Settings(1000, 5))
    wishes = run.setting.wishes_of(run.platoons)
    drivers = run.setting.driver_records()
    needs = memory_needs(run.router, run.platoons, wishes, drivers, run.settings)
    assert needs["the weights of 1,520 ways on for 76 destinations"] == 2 * 1520 * 64
    assert run.world.routes.history.nbytes == 2 * 1520 * 64
    links = needs["1,520 links"]
    of_queues = run.world.links.queue[:1520].nbytes
    assert of_queues < links < 3 * of_queues
    check_memory({"weights": 3e9, "links": 1e9}, Machine(memory_gb=4.0))
    with pytest.raises(InputError, match=r"needs 4 GB .* 3 GB for weights, 1 GB for links"):
        check_memory({"links": 1e9, "weights": 3e9}, Machine(memory_gb=3.9))


def test_results_do_not_depend_on_the_machine() -> None:
    case = network(grid(6)), across(6, 20.0, 100.0), Settings(600, 5)
    runs = [
        simulate(*case, machine=machine)
        for machine in (None, Machine(1, math.inf), Machine(threads=3, memory_gb=0.5))
    ]
    assert len({hash_of(run) for run in runs}) == 1


@pytest.mark.parametrize("told", [{"threads": 0}, {"threads": 1.5}, {"memory_gb": 0.0}])
def test_nonsense_is_refused(told: dict[str, float]) -> None:
    with pytest.raises(InputError, match=next(iter(told))):
        Machine(**told)  # type: ignore[arg-type]


def test_the_environment_says_what_a_run_may_use() -> None:
    assert allowed_machine({}) == Machine()
    told = {"UXSIM_GEO_THREADS": " 3 ", "UXSIM_GEO_MEMORY_GB": "2.5"}
    assert allowed_machine(told) == Machine(3, 2.5)
    assert allowed_machine({"UXSIM_GEO_MEMORY_GB": "inf"}).usable_bytes == math.inf
    with pytest.raises(InputError) as error:
        allowed_machine({"UXSIM_GEO_THREADS": "all", "UXSIM_GEO_MEMORY_GB": "-1"})
    assert [fault.column for fault in error.value.faults] == [
        "UXSIM_GEO_THREADS",
        "UXSIM_GEO_MEMORY_GB",
    ]
