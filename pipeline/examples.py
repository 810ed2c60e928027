"""The examples that come with the program: configurations, and the data that they read."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

from uxsim_geo.errors import Fault, Faults, InputError
from uxsim_geo.files import replace_when_complete, sha256_of

#: folders of examples; configurations name their data as ../data/...
PARTS = ("configs", "data")

#: where a wheel has them; run from the source they lie beside this package
INSTALLED = Path(__file__).parent / "examples"


def copy_examples(place: Path) -> list[Path]:
    """Copy all examples below a folder, made if need be; return the configurations there.

    A file that is there already with the same content stays. Raises
    :class:`uxsim_geo.errors.InputError` if one of another content is in the way; then nothing is
    copied.
    """
    source = _source()
    copies = {path: place / path.relative_to(source) for path in _files(source)}
    faults = Faults(str(place))
    for path, copy in copies.items():
        if copy.exists() and not _is_copy(copy, path):
            faults.add(f"{copy.relative_to(place)} has been changed; name another folder")
    faults.raise_if_any()
    for path, copy in copies.items():
        if not copy.exists():
            _copy(path, copy)
    return sorted(copy for copy in copies.values() if copy.suffix == ".yaml")


def _source() -> Path:
    """Return the folder that holds the examples."""
    for folder in (INSTALLED, Path(__file__).parents[1]):
        if all((folder / part).is_dir() for part in PARTS):
            return folder
    what = "the examples are not there; install the package again, from its wheel or its source"
    raise InputError([Fault(what, str(INSTALLED))])


def _files(source: Path) -> Iterator[Path]:
    for part in PARTS:
        yield from sorted(path for path in (source / part).rglob("*") if path.is_file())


def _is_copy(copy: Path, path: Path) -> bool:
    return copy.is_file() and sha256_of(copy) == sha256_of(path)


def _copy(path: Path, copy: Path) -> None:
    try:
        copy.parent.mkdir(parents=True, exist_ok=True)
        with replace_when_complete(copy) as temporary:
            shutil.copyfile(path, temporary)
    except OSError as error:
        what = f"cannot be written ({error.strerror}); name another folder"
        raise InputError([Fault(what, str(copy))]) from error
