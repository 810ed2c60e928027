"""Makes the pictures of these pages: runs the examples and keeps their plots, smaller."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image, ImageSequence

HERE = Path(__file__).parent
CONFIGS = HERE.parent / "configs"

#: picture here -> configuration, and its file in the run's folder
PICTURES = {
    "gridlock_ring": ("gridlock", "plots/ring.png"),
    "gridlock_ring_density": ("gridlock", "plots/ring_density.png"),
    "gridlock_mfd": ("gridlock", "plots/macroscopic_fundamental_diagram.png"),
    "gridlock_prevented_ring": ("gridlock_prevented", "plots/ring.png"),
    "gridlock_prevented_mfd": (
        "gridlock_prevented",
        "plots/macroscopic_fundamental_diagram.png",
    ),
    "sioux_falls_1800s": ("sioux_falls", "plots/network_1800s.png"),
    "sioux_falls_4200s": ("sioux_falls", "plots/network_4200s.png"),
    "sioux_falls_corridor": ("sioux_falls", "plots/corridor.png"),
    "sioux_falls_mfd": ("sioux_falls", "plots/macroscopic_fundamental_diagram.png"),
    "sioux_falls_corridor_speed": ("sioux_falls", "plots/corridor_speed.png"),
    "sioux_falls_desire_lines": ("sioux_falls", "plots/desire_lines.png"),
    "sioux_falls_travel_times": ("sioux_falls", "plots/travel_times.png"),
    "sioux_falls_diagram": ("sioux_falls", "plots/diagram.png"),
    "sioux_falls_curves": ("sioux_falls", "plots/curves.png"),
    "sioux_falls_vehicles": ("sioux_falls", "plots/vehicles.gif"),
    "sioux_falls_space_time": ("sioux_falls", "space_time.png"),
    "sioux_falls_space_time_south": ("sioux_falls", "space_time_south.png"),
    "sioux_falls_surface": ("sioux_falls", "space_time_surface.png"),
    "gridlock_space_time": ("gridlock", "space_time.png"),
    "gridlock_ramp_metering_space_time": ("gridlock_ramp_metering", "space_time.png"),
}

#: beyond those of the configuration
MORE = {
    "sioux_falls": (
        "{plot: time_space_diagram_traj_links, file: corridor_speed, by_speed: true, "
        "links: [6-8, 8-16, 16-17, 17-19]}",
        "{plot: desire_lines}",
        "{plot: travel_times}",
        "{plot: fundamental_diagram, file: diagram, links: [10-16, 16-17, 17-19]}",
        "{plot: cumulative_curves, file: curves, links: [17-19]}",
        "{plot: network_fancy, file: vehicles, interval_s: 150, frame_ms: 240, trail: 3}",
    )
}

#: what is drawn in space and time
SPACE_TIME = (
    "forms=[png, surface]",
    "cameras=[auto, south]",
)

WIDEST = 1200  # pixels
COLOURS = 96
FILM_WIDTH, FILM_COLOURS = 500, 32  # a page should not weigh more than a megabyte a picture


def main() -> None:
    """Run the examples into a folder that goes afterwards."""
    with tempfile.TemporaryDirectory() as folder:
        for name in dict.fromkeys(config for config, _ in PICTURES.values()):
            _run(name, Path(folder))
        for picture, (config, file) in PICTURES.items():
            source = Path(folder) / config / file
            _keep(source, HERE / "images" / f"{picture}{source.suffix}")


def _run(name: str, folder: Path) -> None:
    path = CONFIGS / f"{name}.yaml"
    text = path.read_text(encoding="utf-8").replace("../data", (CONFIGS.parent / "data").as_posix())
    text += "".join(f"    - {plot}\n" for plot in MORE.get(name, ()))
    copy = folder / f"{name}.yaml"
    copy.write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "pipeline", "run", str(copy), "--out", str(folder)]
    command += ["--set", "report.outputs=[space_time]"]
    for setting in SPACE_TIME:
        command += ["--set", f"report.space_time.{setting}"]
    subprocess.run(command, check=True, cwd=CONFIGS.parent)


def _keep(source: Path, path: Path) -> None:
    """Make a picture as small as the page needs it."""
    if source.suffix == ".gif":
        _keep_film(source, path)
        return
    with Image.open(source) as image:
        small = image.convert("RGB")
        if small.width > WIDEST:
            height = round(small.height * WIDEST / small.width)
            small = small.resize((WIDEST, height), Image.Resampling.LANCZOS)
        small.quantize(COLOURS, dither=Image.Dither.NONE).save(path, optimize=True)


def _keep_film(source: Path, path: Path) -> None:
    """Make a film smaller, in the colours of the picture in its middle."""
    with Image.open(source) as film:
        size = (FILM_WIDTH, round(film.height * FILM_WIDTH / film.width))
        duration = film.info["duration"]
        # as arrays, since pictures keep what only the palette of the source knows: transparency
        pictures = [
            Image.fromarray(np.asarray(one.convert("RGB"))).resize(size, Image.Resampling.LANCZOS)
            for one in ImageSequence.Iterator(film)
        ]
    colours = pictures[len(pictures) // 2].quantize(FILM_COLOURS, dither=Image.Dither.NONE)
    first, *rest = (one.quantize(palette=colours, dither=Image.Dither.NONE) for one in pictures)
    first.save(path, save_all=True, append_images=rest, duration=duration, loop=0, optimize=True)


if __name__ == "__main__":
    main()
