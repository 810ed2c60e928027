"""A case's tables as SUMO reads them: a network made by netconvert, and one trip a vehicle."""

from __future__ import annotations

import subprocess
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
import pandas as pd
from cases import Tables

#: 5 m a vehicle: the jam density 0.2 veh/m of the other engines
KIND = '<vType id="car" length="3" minGap="2" sigma="0" tau="1" speedDev="0" maxSpeed="70"/>'


def write_sumo(tables: Tables, folder: Path, netconvert: str) -> None:
    """Write ``sumo.net.xml`` and ``sumo.trips.xml`` into ``folder``.

    Ids are positions in the tables: SUMO takes few signs in names.
    """
    place = {node: number for number, node in enumerate(tables.nodes["node_id"])}
    _write(folder / "sumo.nod.xml", "nodes", _nodes(tables.nodes))
    _write(folder / "sumo.edg.xml", "edges", _edges(tables.links, place))
    _write(folder / "sumo.trips.xml", "routes", [KIND, *_trips(tables.demand, place)])
    command = [netconvert, "-n", "sumo.nod.xml", "-e", "sumo.edg.xml", "-o", "sumo.net.xml"]
    command += ["--no-internal-links", "--no-warnings"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)


def _write(path: Path, root: str, lines: list[str]) -> None:
    path.write_text("\n".join([f"<{root}>", *lines, f"</{root}>", ""]), encoding="utf-8")


def _element(name: str, **values: object) -> str:
    told = " ".join(f"{key}={quoteattr(str(value))}" for key, value in values.items())
    return f"<{name} {told}/>"


def _nodes(nodes: pd.DataFrame) -> list[str]:
    places = zip(nodes["x"], nodes["y"], strict=True)
    return [_element("node", id=i, x=f"{x:.2f}", y=f"{y:.2f}") for i, (x, y) in enumerate(places)]


def _edges(links: pd.DataFrame, place: dict[str, int]) -> list[str]:
    lines = []
    for number, link in enumerate(links.itertuples()):
        ends = {"from": place[link.from_node_id], "to": place[link.to_node_id]}
        kind = {"numLanes": int(link.lanes), "speed": f"{link.free_speed:.3f}"}
        lines.append(_element("edge", id=number, **ends, **kind, length=f"{link.length:.2f}"))
    return lines


def _trips(demand: pd.DataFrame, place: dict[str, int]) -> list[str]:
    """One trip a vehicle, spread evenly over its row's time; in order of departure."""
    numbers = np.diff(np.rint(demand["vehicles"].cumsum()), prepend=0.0).astype(int)
    row = np.repeat(np.arange(len(demand)), numbers)
    within = np.arange(row.size) - np.repeat(np.cumsum(numbers) - numbers, numbers)
    start, end = (demand[name].to_numpy(float)[row] for name in ("start_s", "end_s"))
    depart = start + (within + 0.5) * (end - start) / numbers[row]
    ends = [demand[name].map(place).to_numpy()[row] for name in ("origin", "destination")]
    order = np.argsort(depart, kind="stable")
    trips = zip(depart[order], ends[0][order], ends[1][order], strict=True)
    return [
        f'<trip id="{i}" type="car" depart="{t:.2f}" fromJunction="{a}" toJunction="{b}"/>'
        for i, (t, a, b) in enumerate(trips)
    ]
