"""Which ways are roads for cars: road class, access, and what is no road (yet, or any more).

Access is said by the most specific of the tags motorcar, motor_vehicle, vehicle and access, each
also by direction. Of several values (``agricultural;forestry``) the most open holds. Values that
nobody knows are taken as open.
"""

from __future__ import annotations

from uxsim_geo.network.osm_options import OsmOptions
from uxsim_geo.network.osm_tags import Tags, values

#: the most specific first
KEYS = ("motorcar", "motor_vehicle", "vehicle", "access")

#: nobody's car may drive here
CLOSED = frozenset(
    [
        "no",
        "agricultural",
        "forestry",
        "military",
        "emergency",
        "psv",
        "bus",
        "taxi",
        "hgv",
        "goods",
        "foot",
        "bicycle",
        "pedestrian",
        "use_sidepath",
        "none",
        "official_vehicles",
    ]
)

#: some cars may, on their own ground
PRIVATE = frozenset(["private", "permit", "residents", "employees", "staff", "members", "delivery"])

#: tags that, as ``yes``, say that a road is not there (yet)
NOT_THERE = ("construction", "proposed", "disused", "abandoned", "razed", "demolished")


def access_of(tags: Tags, direction: str | None = None) -> str | None:
    """What is said of cars, in one direction or altogether; None where nothing is."""
    for key in KEYS:
        for name in (f"{key}:{direction}", key) if direction else (key,):
            if tags.get(name, "").strip():
                return tags[name].strip()
    return None


def is_closed(tags: Tags, direction: str | None, private: bool) -> bool:
    """Whether cars are kept out; ``private``: roads on which some may drive count as open."""
    access = access_of(tags, direction)
    if access is None:
        return False
    closed = CLOSED if private else CLOSED | PRIVATE
    said = values(access)
    return bool(said) and all(value in closed for value in said)


def reason_to_drop(tags: Tags, options: OsmOptions) -> str | None:
    """Why a way with the tag highway is no road here; None if it is one."""
    road_class = tags["highway"]
    if road_class not in options.road_classes:
        return f"highway={road_class}" if road_class in NOT_THERE else "other road classes"
    if tags.get("area") == "yes":
        return "area=yes"
    for key in NOT_THERE:
        if tags.get(key) == "yes":
            return f"{key}=yes"
    if all(is_closed(tags, direction, options.private) for direction in ("forward", "backward")):
        return "closed to cars" if is_closed(tags, None, True) else "private access"
    return None
