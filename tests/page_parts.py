"""Reads what a page holds, without its scripts: as plainly as can be."""

from __future__ import annotations

import base64
import gzip
import json
import re
from typing import Any

import numpy as np
import numpy.typing as npt


def part(page: str, name: str) -> bytes:
    """The bytes of a packed part."""
    found = re.search(rf'<script type="application/octet-stream;base64" id="{name}">(.*?)<', page)
    assert found is not None
    return gzip.decompress(base64.b64decode(found[1]))


def document(page: str) -> dict[str, Any]:
    """The document of plain values."""
    content: dict[str, Any] = json.loads(part(page, "document"))
    return content


def codes(page: str, name: str) -> npt.NDArray[np.int64]:
    """Codes of links × bins."""
    content = document(page)
    top, bins = content["top"], len(content["edges"]) - 1
    dtype = "<u2" if top > 255 else "u1"
    differences = np.frombuffer(part(page, name), dtype).reshape(-1, bins).astype(np.int64)
    return np.cumsum(differences, axis=1) % (top + 1)


def states(page: str) -> dict[str, npt.NDArray[np.float64]]:
    """Density (veh/m), speed (m/s; nan: nobody) and queue (m) of links × bins."""
    content = document(page)
    top, least, largest = content["top"], content["least"], content["largest"]
    code = codes(page, "density")
    density = np.where(code > 0, least * (largest / least) ** ((code - 1) / (top - 1)), 0.0)
    free = np.array(content["links"]["free_kmh"])[:, None] / 3.6
    length = np.array(content["links"]["length"])[:, None]
    return {
        "density": density,
        "speed": np.where(code > 0, codes(page, "speed") / top * free, np.nan),
        "queue": codes(page, "queue") / top * length,
    }


def lines(page: str) -> list[npt.NDArray[np.float64]]:
    """Places of all links, degrees."""
    counts = np.frombuffer(part(page, "points"), "<u4")
    planes = np.frombuffer(part(page, "places"), np.uint8).reshape(4, -1)
    steps = np.ascontiguousarray(planes.T).view("<i4").reshape(-1, 2)
    places = np.cumsum(steps.astype(np.int64), axis=0) * 5e-6
    return np.split(places, np.cumsum(counts)[:-1])
