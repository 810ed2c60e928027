"""Measures that control traffic: one a file, each giving the engine plain numbers."""

from uxsim_geo.control.capacity import LinkCapacity, NodeCapacity
from uxsim_geo.control.closures import Closure, Incident
from uxsim_geo.control.drivers import DriverClass
from uxsim_geo.control.guidance import Advice, EnforcedRoute
from uxsim_geo.control.levers import Levers
from uxsim_geo.control.metering import Feedback, RampMeter
from uxsim_geo.control.own import OwnControl
from uxsim_geo.control.perimeter import Perimeter
from uxsim_geo.control.priorities import MergePriority
from uxsim_geo.control.signals import Phase, Signal
from uxsim_geo.control.site import Measure, Target
from uxsim_geo.control.speed_limits import SpeedLimit
from uxsim_geo.control.tolls import CongestionToll, Toll
from uxsim_geo.control.traffic import Traffic

__all__ = [
    "Advice",
    "Closure",
    "CongestionToll",
    "DriverClass",
    "EnforcedRoute",
    "Feedback",
    "Incident",
    "Levers",
    "LinkCapacity",
    "Measure",
    "MergePriority",
    "NodeCapacity",
    "OwnControl",
    "Perimeter",
    "Phase",
    "RampMeter",
    "Signal",
    "SpeedLimit",
    "Target",
    "Toll",
    "Traffic",
]
