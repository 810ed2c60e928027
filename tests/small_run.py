"""A network of three links in TNTP files, and a configuration for it."""

from __future__ import annotations

from pathlib import Path

from pipeline.cli import main

NET = """<NUMBER OF ZONES> 2
<NUMBER OF NODES> 4
<FIRST THRU NODE> 1
<NUMBER OF LINKS> 3
<END OF METADATA>

~ init_node term_node capacity length free_flow_time b power speed toll link_type ;
 1 3 1800 500 25 0.15 4 0 0 1 ;
 3 4 1800 1000 50 0.15 4 0 0 1 ;
 4 2 1800 500 25 0.15 4 0 0 1 ;
"""

NODES = "node x y ;\n1 0 0 ;\n2 2000 0 ;\n3 500 0 ;\n4 1500 0 ;\n"

TRIPS = """<NUMBER OF ZONES> 2
<TOTAL OD FLOW> 100.0
<END OF METADATA>

Origin 1
 2 : 100.0;
"""

CONFIG = """name: small
ingest:
  net: net.tntp
  nodes: nodes.tntp
  trips:
    file: trips.tntp
    demand_period_s: 600
  crs: none
  length_unit: m
  time_unit: s
  capacity_unit: veh/h
simulate:
  duration_s: 1200
report:
  outputs: [geopackage]
  plots: []
"""


def write_small_run(folder: Path, config: str = CONFIG) -> Path:
    """Write the files into a folder; return the configuration's path."""
    for name, text in (("net", NET), ("nodes", NODES), ("trips", TRIPS)):
        (folder / f"{name}.tntp").write_text(text, encoding="utf-8")
    path = folder / "small.yaml"
    path.write_text(config, encoding="utf-8")
    return path


def run_small(folder: Path, *options: str, command: str = "run") -> int:
    """Run the configuration in a folder, with its results below it; gives the exit status."""
    return main([command, str(folder / "small.yaml"), "--out", str(folder / "runs"), *options])
