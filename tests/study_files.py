"""Studies on the network of three links, and what is left of them."""

from __future__ import annotations

import hashlib
import json
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

from conftest import REPOSITORY
from small_run import CONFIG, write_small_run

from pipeline.progress import Silence
from pipeline.study import Order, run_study

#: short of what a run does, so that many are done soon
BASE = CONFIG.replace("duration_s: 1200", "duration_s: 900")

STUDY = """name: study
base: small.yaml
seeds: 3
comparison: none
scenarios:
  nothing: []
  larger: [{simulate: {platoon_size: 10}}]
"""


class Listener(Silence):
    """Remembers what was said."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def say(self, text: str) -> None:
        self.lines += text.splitlines()


def write_study(folder: Path, text: str = STUDY) -> Path:
    """Write a study and its base into a folder; return the study's path."""
    folder.mkdir(parents=True, exist_ok=True)
    write_small_run(folder, BASE)
    path = folder / "study.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def study(folder: Path, *, scheduler: str = "none", workers: int | None = None) -> Listener:
    """Do the study in a folder, all of it; return what was said, problems at the end."""
    listener = Listener()
    order = Order(folder / "study.yaml", folder / "runs", ["test"], scheduler, workers)
    listener.lines += [f"problem: {line}" for line in run_study(order, listener)]
    return listener


def command(folder: Path, *options: str, name: str = "study") -> list[str]:
    """The command line that does the study in a folder."""
    python = [sys.executable, "-m", "pipeline", name]
    paths = [str(folder / "study.yaml")] if name == "study" else []
    return [*python, *paths, "--out", str(folder / "runs"), *options]


def started(folder: Path, *options: str) -> subprocess.Popen[str]:
    """Start the study in a process of its own, with a pipe for what it says."""
    # what a shell starts in the background ignores Ctrl-C, and so do its children
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return subprocess.Popen(
            command(folder, *options), cwd=REPOSITORY, stderr=subprocess.PIPE, text=True
        )
    finally:
        signal.signal(signal.SIGINT, before)


def results(folder: Path) -> dict[str, str]:
    """SHA-256 of every table of every run of the study, and of its figures."""
    root = folder / "runs/study"
    files = [*root.glob("runs/*/*/**/*.parquet"), *root.glob("runs/*/*/measures/*.json")]
    files += root.glob("figures.csv")
    return {
        path.relative_to(root).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(files)
    }


def manifest(folder: Path) -> dict[str, Any]:
    """The manifest of the study."""
    data: dict[str, Any] = json.loads((folder / "runs/study/manifest.json").read_text())
    return data


def run_folder(folder: Path, scenario: str, seed: int) -> Path:
    """Where a run of the study lies."""
    return folder / f"runs/study/runs/{scenario}/seed_{seed}"


def lines_of(said: Listener, words: str) -> list[str]:
    """The runs, as scenario and seed, of which something was said."""
    found = [line.split(": ") for line in said.lines if words in line and " of " in line]
    return sorted(parts[1] for parts in found)
