"""A run on disk: all that is needed to go on as if it had never stopped.

One zip file of plain parts: state.json, arrays in NumPy's format, the network as GeoParquet.
Nothing in it is ever executed.
"""

from __future__ import annotations

import hashlib
import io
import json
import tempfile
import zipfile
import zlib
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from uxsim_geo.control.levers import QUANTITIES, Levers
from uxsim_geo.control.traffic import Counts
from uxsim_geo.demand.platoons import Platoons
from uxsim_geo.engine.records import LANES, World
from uxsim_geo.engine.steering import History, Steering
from uxsim_geo.errors import Fault, InputError
from uxsim_geo.files import replace_when_complete
from uxsim_geo.network.files import FILES, read_network, write_network
from uxsim_geo.network.network import Network
from uxsim_geo.version import __version__

Arrays = dict[str, npt.NDArray[Any]]

_STATE = "state.json"
_MOMENT = (1980, 1, 1, 0, 0, 0)  # of every part: the same run gives the same bytes
_LARGEST = 1 << 36  # bytes of one array

#: nothing that is written here packs to less than a 230th of its size; and bytes that may anyway
_RATIO, _LEAST_BYTES = 230, 64_000_000

#: parts of the world that are worked on and hold nothing between two steps
_SCRATCH = ("candidate", "passed", "heap", "event", "pending_words")
#: what reading a damaged file may end in; RuntimeError: a method that zipfile cannot undo
_DAMAGED = (
    OSError,
    ValueError,
    KeyError,
    TypeError,
    AttributeError,
    ArithmeticError,
    EOFError,
    MemoryError,  # an array that says to be larger than any
    RuntimeError,
    zipfile.BadZipFile,
    zlib.error,
)
_TEXTS = ("node_ids", "class_names", "routes")


def write_saved(path: Path, network: Network, state: dict[str, Any], arrays: Arrays) -> None:
    """Write a run; ``path`` appears when it is complete."""
    contents = {f"arrays/{name}.npy": _to_bytes(array) for name, array in sorted(arrays.items())}
    with tempfile.TemporaryDirectory() as folder:
        write_network(network, Path(folder))
        for name in FILES.values():
            contents[f"network/{name}"] = (Path(folder) / name).read_bytes()
    digests = {name: hashlib.sha256(content).hexdigest() for name, content in contents.items()}
    told = {"saved_by": __version__, **state, "sha256": digests}
    contents[_STATE] = json.dumps(told, indent=1).encode()
    with replace_when_complete(path) as temporary, zipfile.ZipFile(temporary, "w") as archive:
        for name, content in contents.items():
            archive.writestr(zipfile.ZipInfo(name, _MOMENT), content, zipfile.ZIP_DEFLATED, 1)


def read_saved(path: Path) -> tuple[Network, dict[str, Any], Arrays]:
    """Read a run that :func:`write_saved` has written.

    Raises :class:`InputError` for what is no such file, damaged, or of another version.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            _check_size(path, archive)
            state = json.loads(archive.read(_STATE))
            if state["saved_by"] != __version__:
                what = f"was saved by version {state['saved_by']}, this is {__version__}: run again"
                raise InputError([Fault(what, str(path))])
            contents = {name: archive.read(name) for name in state["sha256"]}
        for name, digest in state["sha256"].items():
            if hashlib.sha256(contents[name]).hexdigest() != digest:
                raise ValueError(f"{name} is not what was saved")
        arrays = {
            Path(name).stem: _from_bytes(content)
            for name, content in contents.items()
            if name.startswith("arrays/")
        }
        with tempfile.TemporaryDirectory() as folder:
            for name in FILES.values():
                (Path(folder) / name).write_bytes(contents[f"network/{name}"])
            network = read_network(Path(folder))
    except InputError:
        raise
    except _DAMAGED as error:
        what = f"is not a saved simulation, or is damaged: {error}"
        raise InputError([Fault(what, str(path))]) from None
    return network, state, arrays


def _check_size(path: Path, archive: zipfile.ZipFile) -> None:
    """Raise ValueError where the parts would unpack to more than a saved run can."""
    size = sum(part.file_size for part in archive.infolist())
    if size > max(_LEAST_BYTES, _RATIO * path.stat().st_size):
        raise ValueError(f"it unpacks to {size / 1e6:,.0f} MB, far more than such files do")


def _to_bytes(array: npt.NDArray[Any]) -> bytes:
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, np.ascontiguousarray(array), allow_pickle=False)
    return buffer.getvalue()


def _from_bytes(content: bytes) -> npt.NDArray[Any]:
    if len(content) > _LARGEST:
        raise ValueError("an array is too large")
    array: npt.NDArray[Any] = np.lib.format.read_array(io.BytesIO(content), allow_pickle=False)
    return array


def world_arrays(world: World) -> Arrays:
    """Return the arrays of a world, by part and name; of buffers, what is used."""
    arrays = {
        f"{part}.{name}": array
        for part, values in world._asdict().items()
        for name, array in values._asdict().items()
        if name not in _SCRATCH
    }
    clock = world.links.clock[0]
    arrays["links.platoon"] = world.links.platoon[: clock["platoons_used"]]
    arrays["routes.trail"] = world.routes.trail[: clock["trail_used"]]
    return {name: to_plain(array) for name, array in arrays.items()}


def to_plain(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return records as rows of bytes; other arrays as they are."""
    if array.dtype.names is None:
        return array
    return np.ascontiguousarray(array).view(np.uint8).reshape(array.size, array.dtype.itemsize)


def from_plain(array: npt.NDArray[Any], dtype: np.dtype[Any]) -> npt.NDArray[Any]:
    """Return an array of this type from what :func:`to_plain` gives.

    Raises ValueError where it is none.
    """
    if dtype.names is not None and array.dtype == np.uint8 and array.ndim == 2:
        if array.shape[1] == dtype.itemsize:
            return array.reshape(-1).view(dtype)
    elif array.dtype == dtype:
        return array
    raise ValueError("an array has another type")


def with_arrays(world: World, arrays: Arrays) -> World:
    """Return a world with the arrays of another one of the same network.

    Raises ValueError where they do not fit.
    """
    parts = {}
    for part, values in world._asdict().items():
        new = {}
        for name, like in values._asdict().items():
            if name in _SCRATCH:
                continue
            new[name] = from_plain(arrays[f"{part}.{name}"], like.dtype)
        parts[part] = values._replace(**new)
    calendar = parts["calendar"]
    parts["calendar"] = calendar._replace(pending_words=calendar.pending.view(np.uint64))
    filled = World(**parts)
    links, drivers = world.routes.road.size, world.routes.driver.size
    arcs, kept = world.routes.arc.size, len(world.routes.worth)
    batches = int(filled.routes.destination["slot"].max(initial=-1)) // LANES + 1
    for array, shape in (
        (filled.links.clock, world.links.clock.shape),
        (filled.links.green, world.links.green.shape),
        (filled.routes.road, (links,)),
        (filled.routes.driver, (drivers,)),
        (filled.routes.node, world.routes.node.shape),
        (filled.routes.vertex, world.routes.vertex.shape),
        (filled.routes.arc, world.routes.arc.shape),
        (filled.routes.incoming, world.routes.incoming.shape),
        (filled.routes.history, (batches * kept, arcs, LANES)),
        (filled.routes.weight, (0 if kept else batches, arcs, LANES)),
        (filled.routes.worth, world.routes.worth.shape),
        (filled.routes.extra, (drivers, links)),
        (filled.routes.observed, world.routes.observed.shape),
        (filled.calendar.bucket, world.calendar.bucket.shape),
        (filled.calendar.pending, world.calendar.pending.shape),
        (filled.log.trips_by_destination, filled.log.trip.shape),
        (filled.log.key, filled.log.trip.shape),
    ):
        if array.shape != shape:
            raise ValueError("arrays do not fit together")
    return filled


def platoon_parts(platoons: Platoons) -> tuple[dict[str, Any], Arrays]:
    """Return texts and arrays of platoons."""
    texts = {name: [*getattr(platoons, name)] for name in _TEXTS}
    names = (one.name for one in fields(Platoons) if one.name not in _TEXTS)
    return texts, {f"platoons.{name}": getattr(platoons, name) for name in names}


def platoons_from(texts: dict[str, Any], arrays: Arrays) -> Platoons:
    """Return the platoons that :func:`platoon_parts` has taken apart."""
    names = (one.name for one in fields(Platoons) if one.name not in _TEXTS)
    return Platoons(
        node_ids=np.array([str(text) for text in texts["node_ids"]], object),
        class_names=tuple(str(text) for text in texts["class_names"]),
        routes=tuple(tuple(str(link) for link in route) for route in texts["routes"]),
        **{name: arrays[f"platoons.{name}"] for name in names},
    )


def steering_parts(steering: Steering) -> tuple[dict[str, Any], Arrays]:
    """Return what control has set and seen so far, as plain values and arrays."""
    arrays: Arrays = {}
    application = steering.application
    for name, levers in (("levers", steering.levers), ("applied", application.applied)):
        arrays |= {f"{name}.{quantity}": getattr(levers, quantity) for quantity in QUANTITIES}
    for gate in application.gates:
        for name in ("headway", "held", "opens"):
            arrays[f"{gate.field}.{name}"] = getattr(gate, name)
    histories = []
    for number, history in enumerate(steering.histories):
        told = asdict(history)
        if history.last is not None:
            arrays[f"history{number}.entered"] = history.last.entered
            arrays[f"history{number}.left"] = history.last.left
            told["last"] = history.last.time
        histories.append(told)
    changes = []
    for number, (time, values) in enumerate(steering.changes):
        changes.append([time, sorted(values)])
        arrays |= {f"change{number}.{name}": array for name, array in values.items()}
    return {"histories": histories, "changes": changes}, arrays


def fill_steering(steering: Steering, told: dict[str, Any], arrays: Arrays) -> None:
    """Bring control to where it was.

    Raises ValueError where it is not the control that was saved.
    """
    if len(steering.rules) != len(told["histories"]):
        raise ValueError("its control is another one")
    application = steering.application
    for name, levers in (("levers", steering.levers), ("applied", application.applied)):
        saved = Levers({quantity: arrays[f"{name}.{quantity}"] for quantity in QUANTITIES})
        for quantity in QUANTITIES:
            setattr(levers, quantity, getattr(saved, quantity))
    for gate in application.gates:
        for name in ("headway", "held", "opens"):
            setattr(gate, name, arrays[f"{gate.field}.{name}"])
    for number, values in enumerate(told["histories"]):
        last = values.pop("last")
        steering.histories[number] = History(**values)
        if last is not None:
            entered, left = (arrays[f"history{number}.{name}"] for name in ("entered", "left"))
            steering.histories[number].last = Counts(float(last), entered, left)
    steering.changes = [
        (float(time), {name: arrays[f"change{number}.{name}"] for name in names})
        for number, (time, names) in enumerate(told["changes"])
    ]
