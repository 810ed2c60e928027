"""Route guidance: links that drivers are advised to prefer or avoid, and routes they are given."""

from __future__ import annotations

import math
from dataclasses import dataclass

from uxsim_geo.control.scheduled import scheduled_rule
from uxsim_geo.control.site import (
    Chosen,
    Claim,
    Rule,
    Site,
    as_ids,
    check_number,
    check_period,
)
from uxsim_geo.control.timetable import Timetable, check_timetable
from uxsim_geo.errors import Faults


@dataclass(frozen=True)
class Advice:
    """To those who follow advice, some links count as if they took so much longer.

    seconds
        above 0 to avoid the links, below 0 to prefer them
    classes
        names of the classes of drivers that it is for; none: for all
    """

    links: Chosen
    seconds: Timetable
    classes: tuple[str, ...] = ()
    begin: float = 0.0
    end: float = math.inf

    def rules(self, site: Site, faults: Faults) -> list[Rule]:
        """Return the rule that gives the advice."""
        check_period(self.begin, self.end, site.duration, faults)
        claim = Claim("advice", site.links(self.links, faults), site.classes(self.classes, faults))
        if not check_timetable(self.seconds, "seconds", site.duration, faults, above=-math.inf):
            return []
        name = f"advice on {site.name_links(claim.positions)}"
        return [scheduled_rule(name, claim, self.seconds, (self.begin, self.end))]


@dataclass(frozen=True)
class EnforcedRoute:
    """Drivers between two nodes who leave home in a period take a given route.

    It is no rule but a route: the engine reads its fields when it makes the platoons.

    origin, destination
        node_ids
    links
        link_ids of the whole route, in the order in which they are driven
    share
        of these drivers, above 0 and up to 1
    classes
        names of the classes of drivers that it is for; none: for all
    """

    origin: str
    destination: str
    links: tuple[str, ...]
    share: float = 1.0
    classes: tuple[str, ...] = ()
    begin: float = 0.0
    end: float = math.inf

    def rules(self, site: Site, faults: Faults) -> list[Rule]:
        """Note what is wrong with the route; there is nothing to call."""
        check_period(self.begin, self.end, site.duration, faults)
        site.classes(self.classes, faults)
        check_number(self.share, "share", faults, above=0.0)
        if self.share > 1:
            faults.add("must be 1 or less", column="share", value=self.share)
        for key in ("origin", "destination"):
            site.node(getattr(self, key), faults, key=key)
        ids = as_ids(self.links)
        site.links(ids, faults)
        for link_id in dict.fromkeys(one for one in ids if ids.count(one) > 1):
            faults.add("stands twice in the route", column="links", value=link_id)
        if all(link_id in site.link_position for link_id in ids) and ids:
            self._check_way(ids, site, faults)
        return []

    def _check_way(self, ids: tuple[str, ...], site: Site, faults: Faults) -> None:
        """Note where the links do not lead from the origin to the destination, or must not."""
        places = [site.link_position[link_id] for link_id in ids]
        starts = [site.node_ids[site.from_node[place]] for place in places]
        ends = [site.node_ids[site.to_node[place]] for place in places]
        if starts[0] != self.origin:
            what = f"begins at node {starts[0]}, not at the origin {self.origin}"
            faults.add(what, column="links", value=ids[0])
        gaps = [number for number in range(1, len(ids)) if starts[number] != ends[number - 1]]
        for number in gaps:
            before = f"{ids[number - 1]} ends at {ends[number - 1]}"
            what = f"begins at node {starts[number]}, but {before}"
            faults.add(what, column="links", value=ids[number])
        driven = len(ids) if gaps else site.drivable(places)
        if driven < len(ids):
            what = (
                f"must not be driven after {ids[driven - 1]} on this route: the turn is banned, "
                "or its node lets no traffic through"
            )
            faults.add(what, column="links", value=ids[driven])
        if ends[-1] != self.destination:
            what = f"ends at node {ends[-1]}, not at the destination {self.destination}"
            faults.add(what, column="links", value=ids[-1])
