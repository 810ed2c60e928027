"""What a world prints while it works."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from uxsim_geo.world.world import World


def print_scenario(world: World, vehicles: float) -> None:
    """Print what is about to be simulated."""
    length = math.fsum(link.length * link.number_of_lanes for link in world.LINKS)
    duration = "to the end of demand" if world.TMAX is None else f"{world.TMAX:,g} s"
    rows = [
        ("scenario", world.name or "(no name)"),
        ("network", f"{len(world.NODES)} nodes, {len(world.LINKS)} links"),
        ("road", f"{length / 1000:,.1f} km of lane"),
        ("demand", f"{vehicles:,.0f} vehicles, in platoons of {world.DELTAN}"),
        ("duration", f"{duration}, in steps of {world.DELTAT:g} s"),
        ("random_seed", str(world.random_seed)),
    ]
    for name, value in rows:
        print(f"{name:<12} {value}")


def print_progress_heading() -> None:
    """Print what the columns of the lines of progress are."""
    print(f"{'time, s':>10} {'vehicles on links':>18} {'mean speed, m/s':>16}")


def print_progress(time: float, vehicles: float, speed: float) -> None:
    """Print where the simulation stands."""
    shown = "-" if math.isnan(speed) else f"{speed:.1f}"
    print(f"{time:>10,.0f} {vehicles:>18,.0f} {shown:>16}")


def print_statistics(figures: dict[str, Any]) -> None:
    """Print the main figures of a run; those of completed trips apart from those of all."""
    completed = figures["completed"]
    rows = [
        ("vehicles departed", figures["vehicles_departed"], "veh"),
        ("trips completed", figures["vehicles_completed"], "veh"),
        ("on the way", figures["vehicles_running"] + figures["vehicles_waiting"], "veh"),
        ("mean speed", figures["average_speed_m_s"], "m/s"),
        ("distance driven", figures["total_distance_veh_m"], "veh·m"),
        ("travel time, all so far", figures["total_travel_time_veh_s"], "veh·s"),
        ("delay, all so far", figures["total_delay_veh_s"], "veh·s"),
        ("mean travel time, completed", completed["average_travel_time_s"], "s"),
        ("mean delay, completed", completed["average_delay_s"], "s"),
    ]
    for name, value, unit in rows:
        shown = "-" if value is None else f"{value:,.1f}" if value % 1 else f"{value:,.0f}"
        print(f"{name:<28} {shown:>14} {unit}")
    if figures["gridlocked"]:
        print("gridlock: some vehicles wait for one another in circles")
