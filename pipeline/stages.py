"""Stages: the steps of the pipeline, each with what it depends on and what it leaves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pipeline.config import Config
from pipeline.progress import Watch
from pipeline.runs import RunFolder


@dataclass(frozen=True)
class Task:
    """What a stage is given.

    figures
        what the stages before left in the manifest, by stage
    begin_writing
        must be called when the inputs have proved good, before the first output is touched: from
        then on the manifest no longer vouches for the outputs of an earlier run
    """

    config: Config
    folder: RunFolder
    figures: dict[str, dict[str, Any]]
    watch: Watch
    begin_writing: Callable[[], None]


@dataclass(frozen=True)
class Outcome:
    """What a stage has done: files written (names in the run folder), in a few words, and how.

    ``figures`` go into the manifest for later stages; ``problems`` say which outputs are missing,
    ``warnings`` what to know before the results are believed.
    """

    outputs: Sequence[str]
    words: str
    figures: dict[str, Any] = field(default_factory=dict)
    problems: Sequence[str] = ()
    warnings: Sequence[str] = ()


@dataclass(frozen=True)
class Stage:
    """A step of the pipeline: what it depends on, and the function that does it.

    keys
        of the configuration, at its top level
    inputs
        the files it reads, by a name for each
    prepare
        sees to it that inputs which are downloaded are there, before it is asked whether the stage
        is up to date
    downloads
        beginnings of the names of inputs that are downloaded: where such are gone and all else is
        as it was, the stage counts as up to date, and they are not downloaded again
    may_leave
        outputs that only some runs have: those of a run that was not finished go before it begins
    storable
        whether the outputs depend on nothing but settings and inputs, and no program changes them
        in their place, so that runs can share them
    """

    name: str
    keys: Sequence[str]
    inputs: Callable[[Config, RunFolder], dict[str, Path]]
    run: Callable[[Task], Outcome]
    prepare: Callable[[Config, Watch], None] | None = None
    downloads: Callable[[Config], tuple[str, ...]] = lambda _config: ()
    may_leave: Sequence[str] = ()
    storable: bool = False
