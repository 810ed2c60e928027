"""Results as layers: one GeoPackage, or a file a layer, and what they say of the run."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.attribution import attribution

if TYPE_CHECKING:
    from pipeline.config import Config
    from pipeline.material import Material
    from uxsim_geo.export.run_description import RunDescription
    from uxsim_geo.network.driving_side import DrivingSide

FOLDER = "layers"

Writers = dict[str, Callable[[Path], None]]


def geopackage(material: Material) -> Writers:
    """The file of all layers."""
    return {"results.gpkg": partial(_write_geopackage, material)}


def geoparquet(material: Material) -> Writers:
    """A file for every layer."""
    return {
        f"{FOLDER}/{name}.parquet": partial(_write_geoparquet, material, name)
        for name in material.layer_names
    }


def flatgeobuf(material: Material) -> Writers:
    """A file for every layer that has geometry."""
    spatial = [
        name
        for name in ("nodes", "links", "od_lines", "trajectories", "import_notes")
        if name in material.layer_names and "geometry" in material.network.links.columns
    ]
    return {f"{FOLDER}/{name}.fgb": partial(_write_flatgeobuf, material, name) for name in spatial}


def describe(material: Material) -> RunDescription:
    """What files say of a run: nothing that differs between two equal ones."""
    from pipeline.control_words import changes_of
    from uxsim_geo.export.run_description import RunDescription

    config = material.config
    return RunDescription(
        config.report.start,
        material.notes,
        information(material),
        name=config.name,
        driving_side=driving_side(config),
        attribution=attribution(config),
        changes=changes_of(config, material.network),
        provenance=_provenance(material),
    )


def driving_side(config: Config) -> DrivingSide:
    """The side of the road on which traffic is shown."""
    osm = config.ingest.osm
    return config.report.driving_side or (osm.side() if osm is not None else "right")


def information(material: Material) -> dict[str, object]:
    """What run_info says."""
    import uxsim_geo.version
    from uxsim_geo.export.run_description import origin_of

    config = material.config
    figures = {name: value for name, value in material.figures.items() if name != "engine_wall_s"}
    completed = figures.pop("completed")
    return {
        "name": config.name,
        "uxsim_geo_version": uxsim_geo.version.__version__,
        "start": origin_of(config.report.start).isoformat(),
        "start_given": config.report.start is not None,
        "bin_s": config.report.bin_s,
        **config.simulate.model_dump(exclude={"classes", "control"}),
        "classes": ", ".join(entry.name for entry in config.simulate.classes),
        "control": config.simulate.control.in_words(),
        **figures,
        **{f"completed_{name}": value for name, value in completed.items()},
    }


def _provenance(material: Material) -> dict[str, Any]:
    """Version, settings, and the SHA-256 of all sources; of paths the names of files alone."""
    import uxsim_geo.version

    settings = material.config.model_dump(exclude={"report": {"plots", "outputs"}})
    return {
        "software": f"uxsim-geo {uxsim_geo.version.__version__}",
        "sources": {
            name: {"file": Path(record.path).name, "sha256": record.sha256}
            for name, record in sorted(material.sources.items())
        },
        "settings": json.loads(json.dumps(settings, default=_without_folders)),
    }


def _without_folders(value: object) -> object:
    return value.name if isinstance(value, Path) else str(value)


def _write_geopackage(material: Material, path: Path) -> None:
    from uxsim_geo.export.geopackage import write_geopackage

    write_geopackage(path, material.layers, describe(material))


def _write_geoparquet(material: Material, name: str, path: Path) -> None:
    from uxsim_geo.export.archives import write_geoparquet

    write_geoparquet(path, material.layers[name])


def _write_flatgeobuf(material: Material, name: str, path: Path) -> None:
    from uxsim_geo.export.archives import write_flatgeobuf

    write_flatgeobuf(path, name, material.layers[name])
