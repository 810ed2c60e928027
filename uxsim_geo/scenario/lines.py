"""The line of a new link: straight, drawn as WKT, or from a file; its ends at its nodes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from uxsim_geo.errors import Faults
from uxsim_geo.network.measure import distances
from uxsim_geo.network.vector_files import read_vector_file
from uxsim_geo.network.wkt import joined_lines, parse_lines

#: m: a line may end so far from its node; more is a slip
FARTHEST = 100.0


def line_between(along: str | Path | None, ends: Any, crs: Any, faults: Faults) -> Any:
    """Return a line (shapely) from node to node, or None and faults of the column ``along``.

    ``ends``: the points of the two nodes, shape (2, 2); WKT is taken to be in ``crs`` already, a
    file says its own. The first and the last point of the line are moved to the nodes, by
    :data:`FARTHEST` at most.
    """
    import shapely

    ends = np.asarray(ends, np.float64)
    if along is None:
        return shapely.LineString(ends)
    from_file = isinstance(along, Path)
    line = _from_file(Path(along), crs, faults) if from_file else _from_text(str(along), faults)
    if line is None:
        return None
    points = shapely.get_coordinates(line)
    _add_far_faults(points, ends, crs, faults)
    return shapely.LineString(np.vstack([ends[:1], points[1:-1], ends[1:]]))


def _from_text(text: str, faults: Faults) -> Any:
    lines, wrong = parse_lines([text])
    for what in wrong.values():
        faults.add(what, column="along", value=text)
    return lines[0]


def _from_file(path: Path, crs: Any, faults: Faults) -> Any:
    own = Faults()
    table = read_vector_file(path, None, own)
    if table is not None and len(table) != 1:
        own.add(f"must hold one line, and holds {len(table)} features")
    elif table is not None and crs is not None and table.crs is None:
        own.add("does not say its reference system: write it into the file")
    elif table is not None and crs is None and table.crs is not None:
        own.add("has a reference system, and the network has none: give the line as WKT")
    if own.found:
        for fault in own.found:
            faults.add(fault.what, column="along", value=str(path))
        return None
    assert table is not None
    table = table if crs is None else table.to_crs(crs)
    lines, wrong = joined_lines(table.geometry.to_numpy())
    if wrong or lines[0] is None:
        faults.add(wrong.get(0, "holds no line"), column="along", value=str(path))
    return lines[0]


def _add_far_faults(points: Any, ends: Any, crs: Any, faults: Faults) -> None:
    """Note a line that does not begin at its first node and end at its last."""
    apart = distances(points[[0, -1]], ends, crs)
    if (apart <= FARTHEST).all():
        return
    turned = distances(points[[-1, 0]], ends, crs)
    if (turned <= FARTHEST).all():
        what = "is drawn from the last node to the first: turn it round, or change from and to"
    else:
        words = (
            f"{metres:,.0f} m from where the link {at}"
            for metres, at in zip(apart, ("starts", "ends"), strict=True)
            if metres > FARTHEST
        )
        what = f"is {' and '.join(words)}; {FARTHEST:g} m is the most"
    faults.add(what, column="along")
