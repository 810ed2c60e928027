"""``space_time.html``: a scene to turn, in one file that needs no network.

The page draws by WebGL with a script of its own; nothing of it comes from elsewhere, and no OpenGL
is needed where it is written. Arrays are packed: coordinates as whole numbers of 1/32,767 of twice
the map's larger side, all of them gzipped.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from uxsim_geo.export.page.packing import packed
from uxsim_geo.export.space_time.framing import best_side
from uxsim_geo.export.space_time.look import Look
from uxsim_geo.files import replace_when_complete

TEMPLATE = "page.html.jinja"
SCRIPT = Path(__file__).with_name("page.js")

UNIT = 16_383  # whole numbers a side of the map; coordinates lie between −2 and 2 of them
SHOWN_TIMES = 120  # of the clock beside the slider

QUADS = ("ribbons", "queues")
LINES = ("minor", "major", "slow", "trajectories")

#: numbers of links and bins, and how they are told: whole numbers
FIGURES = ("links.speed", "links.density", "links.queue", "links.free")
WALLS = ("walls.link", "walls.first", "walls.last")


def write_page(path: Path, scene: dict[str, Any], look: Look) -> None:
    """Write a scene of :func:`uxsim_geo.export.space_time.scene.space_time_scene` as a page."""
    import jinja2

    places, packed_arrays = _packed(_arrays(scene))
    texts = json.dumps(_texts(scene, look) | {"arrays": places}, ensure_ascii=False)
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
    )
    page = environment.get_template(TEMPLATE).render(
        title=str(scene["title"]),
        attribution=str(scene["attribution"]),
        # a name must not end the script that holds it
        texts=texts.replace("<", "\\u003c"),
        arrays=packed_arrays,
        script=SCRIPT.read_text(encoding="utf-8"),
    )
    with replace_when_complete(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


def _arrays(scene: dict[str, Any]) -> dict[str, Any]:
    """Arrays by name, in the numbers that the page unpacks."""
    arrays: dict[str, Any] = {}
    for name in (*QUADS, *LINES):
        rows = "faces" if name in QUADS else "lines"
        points = np.clip(np.rint(np.asarray(scene[f"{name}.points"]) * UNIT), -32_767, 32_767)
        arrays[f"{name}.points"] = points.astype(np.int16)
        arrays[f"{name}.{rows}"] = np.asarray(scene[f"{name}.{rows}"]).astype(np.int32)
        arrays[f"{name}.rgb"] = np.asarray(scene[f"{name}.rgb"]).astype(np.uint8)
    for name in FIGURES:
        arrays[name] = np.minimum(np.rint(np.nan_to_num(scene[name])), 65_535).astype(np.uint16)
    for name in WALLS:
        arrays[name] = np.asarray(scene[name]).astype(np.int32)
    return arrays


def _packed(arrays: dict[str, Any]) -> tuple[dict[str, Any], str]:
    """Where each array lies among all bytes, and those gzipped, in base64."""
    places, parts, at = {}, [], 0
    for name, array in arrays.items():
        data = np.ascontiguousarray(array).tobytes()
        places[name] = {"at": at, "count": int(array.size), "type": str(array.dtype)}
        padded = data + bytes(-len(data) % 4)  # typed arrays begin at multiples of their size
        parts.append(padded)
        at += len(padded)
    return places, packed(b"".join(parts), level=9)


def _texts(scene: dict[str, Any], look: Look) -> dict[str, Any]:
    """Texts, and what is small enough to be told in words."""
    duration = float(scene["duration"])
    edges = np.asarray(scene["edges"], float).tolist()
    clock = look.clock(edges)
    times = [clock.text(duration * share / SHOWN_TIMES) for share in range(SHOWN_TIMES + 1)]
    plain = ("notes", "scale_labels", "scale_rgb", "ground", "corners", "names")
    return {
        "unit": UNIT,
        "times": times,
        "clock": [clock.text(edge) for edge in edges],
        "height": float(scene["height"]),
        "subtitle": str(scene["subtitle"]),
        "scale_title": str(scene["scale_title"]),
        "first": best_side(scene, look),
        "boxes": len(scene["ribbons.faces"]) // 6,
        "marks": _rounded(scene["marks.points"]),
        "feet": _rounded(scene["feet"]),
        "axes": [_axis(scene, number) for number in range(4)],
        **{name: np.asarray(scene[name]).tolist() for name in plain},
    }


def _axis(scene: dict[str, Any], number: int) -> dict[str, Any]:
    return {
        "segments": _rounded(scene[f"axes{number}.segments"]),
        "points": _rounded(scene[f"axes{number}.points"]),
        "texts": scene[f"axes{number}.texts"].tolist(),
        "side": _rounded(scene[f"side{number}.segments"]),
    }


def _rounded(points: Any) -> Any:
    return np.round(np.asarray(points, float), 5).tolist()
