"""The command line: ``uxsim-geo``."""

from __future__ import annotations

import argparse
import sys
import traceback
from collections.abc import Sequence
from contextlib import suppress
from typing import TYPE_CHECKING

from pipeline.commands import (
    comparing,
    examples,
    exporting,
    fetching,
    looking,
    running,
    studying,
)
from pipeline.commands.status import FAILED, INPUT_AT_FAULT
from pipeline.lines import show
from uxsim_geo.errors import InputError
from uxsim_geo.version import __version__

if TYPE_CHECKING:
    from pipeline.runs import RunFolder

#: modules with commands, in the order of the help
COMMANDS = (running, studying, comparing, looking, exporting, fetching, examples)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; return the exit status: 0 done, 2 input at fault, 1 anything else."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    options = _parser().parse_args(given)
    options.arguments, options.folder = given, None
    try:
        status: int = options.command(options)
        return status
    except InputError as error:
        for fault in error.faults:
            show(f"error: {fault}", sys.stderr)
        _log_faults(error, options.folder)
        return INPUT_AT_FAULT
    except KeyboardInterrupt:
        show("error: interrupted; what was finished before stays", sys.stderr)
        return FAILED
    except Exception as error:  # noqa: BLE001  the last place where it can be told
        _report_failure(error, options.folder)
        return FAILED


def _log_faults(error: InputError, folder: RunFolder | None) -> None:
    """Note the faults in the log of a run that is there; faulty input makes no folder."""
    # they have been shown: a log that cannot be written adds nothing to them
    with suppress(OSError, InputError):
        if folder is not None and folder.path.is_dir():
            folder.log("\n".join(f"error: {fault}" for fault in error.faults))


def _report_failure(error: Exception, folder: RunFolder | None) -> None:
    """Say in a line what went wrong; how it came to that goes to the run's log, if there is one."""
    what = f"error: {type(error).__name__}: {error}"
    if folder is not None:
        from pipeline.runs import LOG

        try:
            folder.log("".join(traceback.format_exception(error)))
            what = f"{what}; details in {folder / LOG}"
        except (OSError, InputError) as failure:
            what = f"{what}; no details, since there is no log: {failure}"
    show(what, sys.stderr)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="uxsim-geo", description="Dynamic traffic simulation from network files to maps."
    )
    parser.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    for module in COMMANDS:
        module.add_commands(commands)
    return parser
