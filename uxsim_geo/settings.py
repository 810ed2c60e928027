"""What a simulation is told beside its network and its demand."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from uxsim_geo.errors import Faults

#: outside of these no model of traffic is meant, and a run would not end
SMALLEST = {"reaction_time": 0.01}
LARGEST = {"reaction_time": 100.0, "platoon_size": 10_000, "duration": 1e8}
MOST_STEPS = 5e7


@dataclass(frozen=True)
class Settings:
    """Model parameters, with the defaults of Seo (2023).

    duration
        end of the simulation, s after the start
    platoon_size
        Δn, vehicles that move together
    reaction_time
        τ, s; with jam density κ it gives the wave speed 1/(τκ)
    route_update_interval
        s between two updates of route choice
    route_update_weight
        λ in B ← (1−λ)B + λ·tree; 1 forgets the past, 0 never learns
    route_noise
        link times are multiplied by 1 + noise·U(0, 1) at every update
    seed
        of every draw; the same seed gives the same bytes
    route_choice
        ``inertia``: B follows the trees as above; ``logit``: at every node the out-links that lead
        nearer are chosen with probability ∝ exp(−(cost over that link) / logit_spread), by the
        costs of the last update alone
    logit_spread
        s; a route that costs so much more is chosen 1/e times as often
    route_update_gradual
        ten times as many updates that together weigh the same, so that routes change in small
        steps
    no_cycles
        nobody drives to a node where it has been before, unless all out-links that have any
        weight lead there
    deterministic
        no draws, whatever the seed: departures lie in the middle of their share (at its end where
        demand is truncated), the out-link of the greatest weight is chosen, competing links are
        served in turn by their merge priorities, and times are without noise
    demand_rounding
        ``conserve`` keeps every vehicle (the last platoon of a pair may be smaller), ``truncate``
        cuts every demand row to whole platoons
    """

    duration: float
    platoon_size: int = 5
    reaction_time: float = 1.0
    route_update_interval: float = 600.0
    route_update_weight: float = 0.5
    route_noise: float = 0.01
    seed: int = 0
    demand_rounding: Literal["conserve", "truncate"] = "conserve"
    route_choice: Literal["inertia", "logit"] = "inertia"
    logit_spread: float = 60.0
    route_update_gradual: bool = False
    no_cycles: bool = False
    deterministic: bool = False

    @property
    def step(self) -> float:
        """Δt = τΔn, s: how often nodes are visited and waiting platoons choose again."""
        return self.reaction_time * self.platoon_size

    def __post_init__(self) -> None:
        faults = Faults("settings")
        self._add_range_faults(faults)
        if not isinstance(self.platoon_size, int):
            faults.add(
                "must be a whole number of vehicles", column="platoon_size", value=self.platoon_size
            )
        if not 0 <= self.route_update_weight <= 1:
            weight = self.route_update_weight
            faults.add("must lie between 0 and 1", column="route_update_weight", value=weight)
        if not 0 <= self.route_noise < float("inf"):
            faults.add("must be 0 or more", column="route_noise", value=self.route_noise)
        self._add_choice_faults(faults)
        if not isinstance(self.seed, int) or not 0 <= self.seed < 2**63:
            faults.add("must be a whole number from 0 to 2^63 - 1", column="seed", value=self.seed)
        faults.raise_if_any()

    def _add_choice_faults(self, faults: Faults) -> None:
        for name, known in (
            ("demand_rounding", ("conserve", "truncate")),
            ("route_choice", ("inertia", "logit")),
        ):
            if getattr(self, name) not in known:
                faults.add(f"must be {' or '.join(known)}", column=name, value=getattr(self, name))
        for name in ("route_update_gradual", "no_cycles", "deterministic"):
            if not isinstance(getattr(self, name), bool):
                faults.add("must be true or false", column=name, value=getattr(self, name))

    def _add_range_faults(self, faults: Faults) -> None:
        for name in (
            "duration",
            "platoon_size",
            "reaction_time",
            "route_update_interval",
            "logit_spread",
        ):
            value = getattr(self, name)
            smallest, largest = SMALLEST.get(name, 0.0), LARGEST.get(name, float("inf"))
            if not (0 < value < float("inf")):
                faults.add("must be a finite number above 0", column=name, value=value)
            elif value < smallest:
                faults.add(f"must be {smallest:g} or more", column=name, value=value)
            elif value > largest:
                faults.add(f"must be {largest:g} or less", column=name, value=value)
        if not faults.found and self.duration / self.step > MOST_STEPS:
            faults.add(
                f"makes more than {MOST_STEPS:g} steps of reaction_time * platoon_size = "
                f"{self.step:g} s: shorten it, or make platoons larger",
                column="duration",
                value=self.duration,
            )
