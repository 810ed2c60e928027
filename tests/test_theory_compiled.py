"""The same proofs without the compiler: every kernel as plain Python."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

#: one test of each kind, at one size of platoons that is not one vehicle
PROOFS = (
    "test_theory_links.py::test_a_free_trip_takes_the_free_flow_time[5]",
    "test_theory_links.py::test_a_bottleneck_delays_by_its_queue[two lanes to one-5]",
    "test_theory_links.py::test_a_queue_spills_back_over_three_links[node-0.6-0.2-3-10]",
    "test_theory_links.py::test_a_standing_queue_discharges_at_capacity[2-10]",
    "test_theory_links.py::test_a_moving_queue_discharges_at_capacity[1-10]",
    "test_theory_links.py::test_a_queue_dissolves_after_the_peak[1-10]",
    "test_theory_links.py::test_a_full_link_holds_its_jam_density[3-10]",
    "test_theory_links.py::test_short_links_keep_time_and_capacity[17.3-5]",
    "test_theory_links.py::test_a_smaller_platoon_takes_its_own_share_of_the_road",
    "test_theory_nodes.py::test_a_diverge_gives_both_branches_the_pace_of_the_slower[10]",
    "test_theory_nodes.py::test_origins_go_before_links_for_the_same_opening[5]",
    "test_theory_nodes.py::test_trips_end_in_mid_network_at_the_pace_of_their_own_link[5]",
    "test_theory_nodes.py::test_gridlock_is_told_from_a_long_queue[10]",
    "test_theory_nodes.py::test_a_saturated_merge_shares_by_priority[priorities3-10]",
    "test_theory_nodes.py::test_a_merge_gives_the_rest_to_the_other_link[0.3-10]",
    "test_theory_routes.py::test_the_longer_of_two_parallel_links_is_taken_once_the_short_one_stands[10]",
    "test_theory_routes.py::test_a_new_route_is_taken_up_with_inertia[0.5-10]",
    "test_engine_twin.py::test_all_passages_are_those_of_the_twin[merge 1:3-10]",
    "test_engine_twin.py::test_all_passages_are_those_of_the_twin[diverge-10]",
    "test_engine_twin.py::test_all_passages_on_drawn_trees_are_those_of_the_twin[10]",
    "test_properties.py::test_in_every_run_all_of_this_holds[10]",
)


def test_the_theory_holds_without_the_compiler() -> None:
    here = Path(__file__).parent
    paths = os.pathsep.join([str(here), str(here.parent)])
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": paths}
    options = ["-q", "-p", "no:cacheprovider", "-p", "no:xdist"]
    command = [sys.executable, "-m", "pytest", *options, *(str(here / proof) for proof in PROOFS)]
    done = subprocess.run(
        command, cwd=here.parent, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.search(rf"^{len(PROOFS)} passed", done.stdout, re.MULTILINE), done.stdout
