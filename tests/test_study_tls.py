"""Studies by Dask over TLS, as the documentation has it: only who has the key is let in."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from conftest import REPOSITORY
from study_files import STUDY, command, results, study, write_study

pytest.importorskip("distributed", reason="the extra dask is not installed")

ONE = STUDY.replace("seeds: 3", "seeds: 1")


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Variables by which Dask asks for TLS with a certificate of our own."""
    if shutil.which("openssl") is None:
        pytest.skip("openssl makes the certificate, and is not here")
    folder = tmp_path_factory.mktemp("tls")
    words = "openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=uxsim-geo"
    made = [*words.split(), "-keyout", "key.pem", "-out", "cert.pem"]
    subprocess.run(made, cwd=folder, check=True, capture_output=True)
    settings = {"REQUIRE_ENCRYPTION": "true", "TLS__CA_FILE": str(folder / "cert.pem")}
    for role in ("SCHEDULER", "WORKER", "CLIENT"):
        settings[f"TLS__{role}__CERT"] = str(folder / "cert.pem")
        settings[f"TLS__{role}__KEY"] = str(folder / "key.pem")
    dask = {f"DASK_DISTRIBUTED__COMM__{name}": value for name, value in settings.items()}
    return {**os.environ, **dask, "PYTHONPATH": str(REPOSITORY)}


def dask(environment: dict[str, str], *arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "dask", *arguments],
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
    )


@pytest.fixture
def address(environment: dict[str, str]) -> Iterator[str]:
    """Address of a scheduler with a worker."""
    words = "scheduler --protocol tls --host 127.0.0.1 --port 0 --no-dashboard"
    scheduler = dask(environment, *words.split())
    assert scheduler.stderr is not None
    found = ""
    for line in scheduler.stderr:
        if "Scheduler at:" in line:
            found = line.split("Scheduler at:")[1].strip()
            break
    worker = dask(environment, *f"worker {found} --nthreads 1 --no-nanny --no-dashboard".split())
    try:
        yield found
    finally:
        for process in (worker, scheduler):
            process.kill()
            process.communicate()


def test_tls_leaves_the_same_bytes_and_lets_in_no_one_without_the_key(
    tmp_path: Path, environment: dict[str, str], address: str
) -> None:
    assert address.startswith("tls://")
    write_study(tmp_path / "here", ONE)
    study(tmp_path / "here")
    write_study(tmp_path, ONE)
    words = command(tmp_path, "--scheduler", address)
    done = subprocess.run(
        words, cwd=REPOSITORY, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert results(tmp_path) == results(tmp_path / "here")
    # one without a certificate
    plain = {key: value for key, value in environment.items() if not key.startswith("DASK_")}
    words = command(tmp_path, "--scheduler", address, "--force")
    refused = subprocess.run(
        words, cwd=REPOSITORY, env=plain, capture_output=True, text=True, check=False
    )
    assert refused.returncode == 2, refused.stderr
    assert "no Dask cluster with workers there" in refused.stderr
    assert "Traceback" not in refused.stderr
