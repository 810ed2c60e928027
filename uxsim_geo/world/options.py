"""What a world is told: UXsim's arguments as settings of this library."""

from __future__ import annotations

import difflib
import math
import secrets
from collections.abc import Iterable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, Literal

from uxsim_geo.errors import Fault, Faults, InputError
from uxsim_geo.settings import Settings
from uxsim_geo.world import values

#: UXsim's arguments that change nothing here, and why
WITHOUT_EFFECT = {
    "eular_dx": "states are exact at any resolution",
    "instantaneous_TT_timestep_interval": "present travel times are exact at any time",
    "vehicle_logging_timestep_interval": "link entries and exits are always kept",
    "reduce_memory_delete_vehicle_route_pref": "vehicles hold no routes of their own",
    "threads": "one thread is used",
    "cpp": "the engine is always compiled",
    "show_progress": "print_mode decides",
    "meta_data": "see user_attribute",
}

#: fields of the settings by the arguments that set them
ARGUMENTS = {
    "duration": "tmax",
    "platoon_size": "deltan",
    "route_update_interval": "duo_update_time",
    "route_update_weight": "duo_update_weight",
    "route_noise": "duo_noise",
    "seed": "random_seed",
    "deterministic": "hard_deterministic_mode",
    "no_cycles": "no_cyclic_routing",
    "route_update_gradual": "route_choice_update_gradual",
}

#: settings that are numbers
NUMBERS = frozenset(
    {"duration", "logit_spread", "reaction_time", "route_noise"}
    | {"route_update_interval", "route_update_weight"}
)

_SEEDS = 2**31


def check_others(others: Mapping[str, Any], known: list[str]) -> None:
    """Raise TypeError for an argument that neither means anything here nor is known harmless."""
    for name in others:
        if name not in WITHOUT_EFFECT:
            near = difflib.get_close_matches(name, [*known, *WITHOUT_EFFECT], n=1)
            advice = f"; did you mean {near[0]}?" if near else ""
            raise TypeError(f"World has no argument {name}{advice}")


def refuse_others(function: str, others: Iterable[str]) -> None:
    """Raise TypeError for an argument that a function does not have, with what there is instead."""
    for name in others:
        advice = f": {INSTEAD_OF_ARGUMENTS[name]}" if name in INSTEAD_OF_ARGUMENTS else ""
        raise TypeError(f"{function} has no argument {name}{advice}")


def check_principle(principle: str) -> None:
    """Raise InputError for another principle of route choice than the one there is."""
    if principle != "homogeneous_DUO":
        what = "must be homogeneous_DUO; for a logit choice see the argument route_choice"
        raise InputError([Fault(what, "World", None, "route_choice_principle", principle)])


def seed_of(random_seed: Any) -> Any:
    """Return the seed, drawn where none is given."""
    return secrets.randbelow(_SEEDS) if random_seed is None else _whole(random_seed)


def settings_of(told: Mapping[str, Any]) -> Settings:
    """Return settings; raises InputError in the words of the arguments."""
    faults = Faults("World")
    for name in sorted(NUMBERS & told.keys()):
        values.number(faults, ARGUMENTS.get(name, name), told[name], least=-math.inf)
    faults.raise_if_any()
    try:
        return Settings(**{**told, "platoon_size": _whole(told["platoon_size"])})
    except InputError as error:
        raise _in_words_of_arguments(error) from None


def end_at(settings: Settings, tmax: float) -> Settings:
    """Return the same settings with another end; raises InputError where there is none."""
    try:
        return replace(settings, duration=tmax)
    except InputError as error:
        raise _in_words_of_arguments(error) from None


def _in_words_of_arguments(error: InputError) -> InputError:
    return InputError(
        Fault(
            fault.what, "World", None, ARGUMENTS.get(str(fault.column), fault.column), fault.value
        )
        for fault in error.faults
    )


def _whole(value: Any) -> Any:
    """Return a whole number of any type as an int; the rest is left for the settings to refuse."""
    try:
        return int(value) if int(value) == value else value
    except (TypeError, ValueError):
        return value


RouteChoice = Literal["inertia", "logit"]
Rounding = Literal["conserve", "truncate"]


#: names that UXsim's users may look for, and what there is instead
INSTEAD = {
    "load_scenario": "such files are pickles, which can run code: use load_scenario_from_csv",
    "save_scenario": "network and result are tables: save those",
    "save": "network and result are tables: save those",
    "defRoute": "a route is a list of links: addVehicle(..., route=[...])",
    "adddemand_area2area": "call adddemand for pairs of get_nodes_in_area: nothing is cut here",
    "adddemand_area2area2": "call adddemand for pairs of get_nodes_in_area: nothing is cut here",
    "adddemand_nodes2nodes": "call adddemand for every pair: nothing is cut here",
    "adddemand_nodes2nodes2": "call adddemand for every pair: nothing is cut here",
    "adddemand_point2point": "call adddemand for two of get_nearest_node",
    "ADJ_MAT": "network.links holds both end nodes of every link",
    "ROUTECHOICE": "route choice is set by the arguments of World",
}

_ROUTE = "give the whole route=[...]; or let simulate(..., control=[Advice(...)]) advise"

#: arguments of UXsim's addVehicle, and what there is instead
INSTEAD_OF_ARGUMENTS = {
    "attribute": "data of your own belong into user_attribute",
    "departure_time_is_time_step": "departure_time is in s: multiply the step by DELTAT",
    "links_avoid": _ROUTE,
    "links_prefer": _ROUTE,
    "mode": "every vehicle makes one trip; add another for the way on",
    "route_choice_principle": "route choice is set by the arguments of World",
    "trip_abort": "who comes to a dead end ends the trip there",
    "user_function": "give one to World, which can look at its VEHICLES",
}


def absent(
    kind: str, name: str, known: Iterable[str], instead: Mapping[str, str] = MappingProxyType({})
) -> str:
    """Say that something has no such attribute, and what may be meant."""
    if name in instead:
        return f"{kind} has no {name}: {instead[name]}"
    near = difflib.get_close_matches(name, [one for one in known if one[0] != "_"], n=1)
    return f"{kind} has no {name}" + (f"; did you mean {near[0]}?" if near else "")
