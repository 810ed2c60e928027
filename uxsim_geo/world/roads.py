"""Roads under construction: nodes and links, added by UXsim's names."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

from uxsim_geo.errors import Faults
from uxsim_geo.settings import Settings
from uxsim_geo.world.elements import Element, unknown
from uxsim_geo.world.links import Link
from uxsim_geo.world.nodes import Node
from uxsim_geo.world.values import Pricing

if TYPE_CHECKING:
    from uxsim_geo.world.run import Run

#: s: a time that lies this little before a step counts as its beginning
ROUNDING = 1e-9


class Roads:
    """Nodes and links that a script has added, and the model parameters they are added under."""

    def __init__(self, settings: Settings, tmax: float | None) -> None:
        self._settings = settings
        self._tmax = tmax
        self._nodes: dict[str, Node] = {}
        self._links: dict[str, Link] = {}
        #: of links and nodes, called with them at the end of every time step
        self._functions: dict[Element, Callable[[Any], object]] = {}
        self._run: Run | None = None

    def __getstate__(self) -> dict[str, Any]:
        if self._run is not None:
            raise TypeError("a world can be copied before finalize_scenario() only")
        return self.__dict__

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        for node in self._nodes.values():
            node.inlinks, node.outlinks = {}, {}
        for link in self._links.values():
            self._join(link)

    @property
    def DELTAN(self) -> int:
        """Vehicles of a platoon."""
        return self._settings.platoon_size

    @property
    def DELTAT(self) -> float:
        """Length of a time step τΔn, s."""
        return self._settings.step

    @property
    def REACTION_TIME(self) -> float:
        """Reaction time τ, s."""
        return self._settings.reaction_time

    @property
    def TMAX(self) -> float | None:
        """End of the simulation, s; None while it is not known."""
        return self._tmax

    @property
    def TSIZE(self) -> int | None:
        """Time steps from the start to the end; None while the end is not known."""
        return None if self._tmax is None else math.ceil(self._tmax / self.DELTAT - ROUNDING)

    @property
    def TIME(self) -> float:
        """Where the simulation stands, s after the start."""
        return 0.0 if self._run is None else self._run.time

    @property
    def T(self) -> int:
        """Time steps that are over."""
        return int(self.TIME / self.DELTAT + ROUNDING)

    def on_time(self, time: float) -> bool:
        """Whether the time step under way is that in which a time (s) lies."""
        return self.T == int(time / self.DELTAT + ROUNDING)

    @property
    def NODES(self) -> list[Node]:
        """All nodes, in the order in which they were added."""
        return list(self._nodes.values())

    @property
    def LINKS(self) -> list[Link]:
        """All links, in the order in which they were added."""
        return list(self._links.values())

    def addNode(
        self,
        name: str,
        x: float,
        y: float,
        signal: Sequence[float] = (0,),
        signal_offset: float = 0,
        signal_offset_old: float | None = None,
        flow_capacity: float | None = None,
        number_of_lanes: int | None = None,  # noqa: ARG002
        attribute: Any = None,
        user_attribute: Any = None,
        user_function: Callable[[Node], object] | None = None,
    ) -> Node:
        """Add a node.

        signal
            durations of the phases, s; [0]: no signal. Links name theirs by ``signal_group``
        signal_offset, signal_offset_old
            time at which a first cycle begins, s; the cycle less that time, as UXsim had it once
        flow_capacity
            veh/s that may pass from link to link; None: no limit. ``number_of_lanes``, which
            UXsim has for it, changes nothing: passages follow one another at this rate exactly

        Raises :class:`uxsim_geo.errors.InputError` with all that is wrong.
        """
        self._check_new("node", name, self._nodes)
        told = {
            "x": x,
            "y": y,
            "signal": signal,
            "signal_offset": signal_offset,
            "signal_offset_old": signal_offset_old,
            "flow_capacity": flow_capacity,
            "attribute": attribute,
            "user_attribute": user_attribute,
        }
        node = Node(self, str(name), len(self._nodes), told)
        node.user_function = user_function
        self._nodes[node.name] = node
        return node

    def addLink(
        self,
        name: str,
        start_node: Node | str,
        end_node: Node | str,
        length: float,
        free_flow_speed: float = 20,
        jam_density: float | None = None,
        jam_density_per_lane: float | None = None,
        number_of_lanes: int = 1,
        merge_priority: float = 1,
        signal_group: int | Sequence[int] = (0,),
        capacity_out: float | None = None,
        capacity_in: float | None = None,
        congestion_pricing: Pricing | None = None,
        eular_dx: float | None = None,  # noqa: ARG002
        attribute: Any = None,
        user_attribute: Any = None,
        user_function: Callable[[Link], object] | None = None,
    ) -> Link:
        """Add a link.

        length, free_flow_speed
            m, m/s
        jam_density, jam_density_per_lane
            veh/m, of all lanes together, or of one; neither: 0.2 of every lane
        merge_priority
            weight where it competes with other links for an out-link
        signal_group
            the phase, or phases, of the signal at its end in which it has green
        capacity_out, capacity_in
            veh/s that may leave or enter it; None: its own capacity
        congestion_pricing
            function of the time in s: toll for those who enter, in s of travel time

        Raises :class:`uxsim_geo.errors.InputError` with all that is wrong.
        """
        self._check_new("link", name, self._links)
        told = {
            "start_node": self.get_node(start_node),
            "end_node": self.get_node(end_node),
            "length": length,
            "free_flow_speed": free_flow_speed,
            "jam_density": jam_density,
            "jam_density_per_lane": jam_density_per_lane,
            "number_of_lanes": number_of_lanes,
            "merge_priority": merge_priority,
            "signal_group": signal_group,
            "capacity_out": capacity_out,
            "capacity_in": capacity_in,
            "congestion_pricing": congestion_pricing,
            "attribute": attribute,
            "user_attribute": user_attribute,
        }
        link = Link(self, str(name), len(self._links), told)
        link.user_function = user_function
        self._links[link.name] = link
        self._join(link)
        return link

    def get_node(self, node: Node | str) -> Node:
        """Return a node by its name, or by one of that name in a copy of this world.

        Raises InputError where there is none.
        """
        name = node.name if isinstance(node, Node) else str(node)
        if name not in self._nodes:
            raise unknown("node", name, list(self._nodes))
        return self._nodes[name]

    def get_link(self, link: Link | str) -> Link:
        """Return a link by its name, or by one of that name in a copy of this world.

        Raises InputError where there is none.
        """
        name = link.name if isinstance(link, Link) else str(link)
        if name not in self._links:
            raise unknown("link", name, list(self._links))
        return self._links[name]

    def get_nearest_node(self, x: float, y: float) -> Node:
        """Return the node nearest to a place; the first of several."""
        if not self._nodes:
            raise unknown("node", f"nearest to {x:g}, {y:g}", [])
        return min(self._nodes.values(), key=lambda node: math.hypot(node.x - x, node.y - y))

    def get_nodes_in_area(self, x: float, y: float, r: float) -> list[Node]:
        """Return the nodes less than ``r`` from a place."""
        return [node for node in self.NODES if math.hypot(node.x - x, node.y - y) < r]

    @staticmethod
    def _join(link: Link) -> None:
        link.start_node.outlinks[link.name] = link
        link.end_node.inlinks[link.name] = link

    def _check_new(self, kind: str, name: object, known: Iterable[str]) -> None:
        faults = Faults(f"{kind} {name}")
        if self._run is not None:
            faults.add("cannot be added once the scenario is final")
        if str(name) in known:
            faults.add("the name is taken already", column="name", value=name)
        if not str(name).strip():
            faults.add("needs a name", column="name", value=name)
        faults.raise_if_any()
