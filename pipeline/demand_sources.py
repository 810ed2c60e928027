"""From the demand that a configuration describes to vehicles between nodes."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

from pipeline.demand_config import (
    DemandEntry,
    GravitySection,
    OdSection,
    PlacesSection,
    TripListSection,
    ZonesSection,
)
from uxsim_geo.errors import InputError

if TYPE_CHECKING:
    from uxsim_geo.demand.access import Access
    from uxsim_geo.demand.demand import Demand
    from uxsim_geo.demand.od_table import OdTable
    from uxsim_geo.demand.points import Points
    from uxsim_geo.network.network import Network


def read_demand_entries(entries: tuple[DemandEntry, ...], network: Network) -> list[Demand]:
    """Read every source; raises :class:`uxsim_geo.errors.InputError` with the faults of all."""
    demands, faults = [], []
    for entry in entries:
        try:
            demands.append(of_class(_read_entry(entry, network), entry.driver_class))
        except InputError as error:
            faults += error.faults
    if faults:
        raise InputError(faults)
    return demands


def of_class(demand: Demand, name: str | None) -> Demand:
    """Return a demand all of whose rows are of a class of drivers; None: as they are."""
    if name is None:
        return demand
    return replace(demand, table=demand.table.assign(**{"class": name}))


def _read_entry(entry: DemandEntry, network: Network) -> Demand:
    from uxsim_geo.demand.od_loading import load_od
    from uxsim_geo.demand.timing import in_time
    from uxsim_geo.demand.transform import scale, shift, whole_vehicles

    access: Access | None
    unknown: Literal["fault", "drop"] = "fault"
    if entry.gravity is not None:
        od, access = _gravity(entry.gravity, network)
    else:
        section = entry.od or entry.trip_list
        assert section is not None
        od, unknown = _read_od(section, network), section.unknown
        access = None if section.zones is None else _access(section.zones, network)
    if entry.rounds():
        od = whole_vehicles(od)[0]
    options = entry.trips_options()
    if options is not None:
        od = in_time(od, options)
    else:
        od = scale(od, entry.factor)[0] if entry.factor != 1 else od
        od = shift(od, entry.start_s)[0] if entry.start_s else od
    return load_od(od, network, access, unknown=unknown).demand


def _read_od(section: OdSection | TripListSection, network: Network) -> OdTable:
    from uxsim_geo.demand.od_files import OdColumns, read_od, read_od_matrix
    from uxsim_geo.demand.omx import OmxCore, read_omx
    from uxsim_geo.demand.tntp import read_tntp_od
    from uxsim_geo.demand.trip_list import TripListOptions, read_trip_list

    points = _points(section, network)
    if isinstance(section, TripListSection):
        options = TripListOptions(section.begin, section.outside, names=section.columns)
        return read_trip_list(section.file, options, points=points)
    ending = section.file.suffix.lower()
    if ending == ".omx":
        cores = () if section.core is None else (OmxCore(section.core),)
        return read_omx(section.file, cores, lookup=section.lookup)
    if ending == ".tntp":
        return read_tntp_od(section.file)
    if section.form == "matrix":
        return read_od_matrix(section.file)
    columns = OdColumns(section.columns, section.class_columns)
    return read_od(section.file, columns, points=points)


def _points(section: PlacesSection, network: Network) -> Points | None:
    from uxsim_geo.demand.points import Points

    if section.points_crs is None:
        return None
    return Points(network, section.points_crs, section.points_within_m)


def _zones(section: ZonesSection, network: Network) -> Any:
    from uxsim_geo.demand.cells import cell_zones
    from uxsim_geo.demand.zones import read_zones

    if section.file is not None:
        return read_zones(section.file, section.zone_column, layer=section.layer)
    assert section.cell_m is not None
    return cell_zones(network, section.cell_m)


def _access(section: ZonesSection, network: Network) -> Access:
    return _access_of(_zones(section, network), section, network)


def _access_of(zones: Any, section: ZonesSection, network: Network) -> Access:
    from uxsim_geo.demand.zones import AccessOptions, access_of_zones

    options = AccessOptions(section.nodes_per_zone, section.within_m, section.weights)
    return access_of_zones(zones, network, options)


def _gravity(section: GravitySection, network: Network) -> tuple[OdTable, Access]:
    from uxsim_geo.demand.calibration import calibrated_impedance
    from uxsim_geo.demand.free_flow import free_flow_times
    from uxsim_geo.demand.gravity import GravityOptions, Impedance, gravity
    from uxsim_geo.demand.trip_ends import TripRates, trip_ends

    zones = _zones(section.zones, network)
    access = _access_of(zones, section.zones, network)
    ends = trip_ends(zones, TripRates(section.productions, section.attractions))
    if section.total_vehicles is not None:
        part = section.total_vehicles / ends["production"].sum()
        ends[["production", "attraction"]] *= part
    times = free_flow_times(network, access)
    options = GravityOptions(section.constraint)
    impedance = Impedance(section.exponent, section.decay_per_min)
    if section.mean_time_s is not None:
        impedance = calibrated_impedance(
            ends, times, section.mean_time_s, impedance=impedance, options=options
        )
    return gravity(ends, times, impedance, options).od, access
