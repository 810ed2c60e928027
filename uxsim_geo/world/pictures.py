"""What becomes of the pictures of a world: saved and shown as it says."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from uxsim_geo.world import options

if TYPE_CHECKING:
    from uxsim_geo.world.figures import Figure
    from uxsim_geo.world.world import World

#: letters of a file's name; file systems take some 255 bytes
LONGEST_NAME = 120

#: looks of UXsim's maps that are passed over: these maps are drawn in one way
LOOKS = frozenset(
    {"antialiasing", "detailed", "figsize", "legend", "legend_outside", "left_handed", "maxwidth"}
    | {"minwidth", "network_font_size", "node_size", "show_id", "state_variables", "width"}
)


def check_looks(looks: dict[str, Any]) -> None:
    """Raise TypeError for a look that no map has."""
    for name in looks:
        if name not in LOOKS:
            raise TypeError(options.absent("a map", name, LOOKS))


@contextmanager
def watching(world: World, path: Path) -> Iterator[Callable[[float], None] | None]:
    """Yield who is told how far a film has come: a bar, where the world prints to a terminal."""
    if not world.print_mode or not sys.stdout.isatty():
        yield None
        return
    from rich.progress import Progress

    with Progress(transient=True) as bar:
        task = bar.add_task(path.name, total=1.0)
        yield lambda share: bar.update(task, completed=share)


def folder(world: World) -> Path:
    """Folder for the pictures and tables of a world."""
    return Path(f"out{world.name}")


def finish(world: World, figure: Figure, name: str) -> Figure:
    """Save a figure to the world's folder and show it, if the world says so."""
    from uxsim_geo.export.saving import save_figure, take_as_written

    take_as_written(figure)
    if world.save_mode:
        folder(world).mkdir(parents=True, exist_ok=True)
        save_figure(figure, folder(world) / f"{_file_name(name)}.png")
    if world.show_mode and "IPython" in sys.modules:
        import_module("IPython.display").display(figure)
    return figure


def _file_name(name: str) -> str:
    """Return a name that any file system takes; of two long ones with one begin, two names."""
    safe = "".join(sign if sign.isalnum() or sign in "-_." else "_" for sign in name)
    if len(safe) <= LONGEST_NAME:
        return safe
    return f"{safe[:LONGEST_NAME]}-{hashlib.sha256(name.encode()).hexdigest()[:8]}"
