"""The scripting face: scenarios by code, with the names that UXsim's users know."""

from uxsim_geo.world.world import World

__all__ = ["World"]
