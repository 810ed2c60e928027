"""Ask whether advisories are known of what is locked: fails on any, says what was not checked.

The advisories are those of PyPI, by way of pip-audit. Where they cannot be asked for (no network,
or a mirror that has none) the step passes, and says that nothing was checked: what is locked has
not changed by that, and a step that fails whenever a server is away would soon be switched off.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

#: advisories that do not touch what is done here: by their ids, each with its reason
ACCEPTED: dict[str, str] = {}

#: s to wait for an answer
TIMEOUT_S = 15


def asked(lock: Path) -> list[dict[str, Any]] | None:
    """What pip-audit says of each package of a lock file; None where it could not ask."""
    command = [sys.executable, "-m", "pip_audit", "--requirement", str(lock), "--disable-pip"]
    command += ["--require-hashes", "--format", "json", "--progress-spinner", "off"]
    command += ["--timeout", str(TIMEOUT_S)]
    command += [part for known in ACCEPTED for part in ("--ignore-vuln", known)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    try:
        found: list[dict[str, Any]] = json.loads(done.stdout)["dependencies"]
    except ValueError:
        # the name of the server and why it does not answer stand in the last line
        print(f"{lock}: {(done.stderr.strip().splitlines() or ['no answer'])[-1]}")
        return None
    return found


def findings(packages: list[dict[str, Any]]) -> list[str]:
    """A line for every advisory."""
    return [
        f"{package['name']} {package['version']}: {told['id']}, mended in "
        f"{', '.join(told['fix_versions']) or 'no version yet'}"
        for package in packages
        for told in package.get("vulns", ())
    ]


def main(locks: list[str]) -> int:
    """Tell of all lock files; 1 where there are advisories."""
    status = 0
    for lock in map(Path, locks):
        packages = asked(lock) or []
        lines = findings(packages)
        checked = sum("vulns" in package for package in packages)
        print(f"{lock}: advisories could be asked for of {checked} of {len(packages)} packages")
        if checked == 0:
            print(f"{lock}: NOT CHECKED, run make audit where pypi.org can be reached")
        for line in lines:
            print(f"{lock}: {line}")
        status |= bool(lines)
    return status


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
