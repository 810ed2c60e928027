"""Search for files that break a reader: ``python tests/fuzz/fuzz.py DOOR SECONDS [FOLDER]``.

With atheris installed (``pip install atheris``) the search is guided by which lines of the project
a case reaches, each new one kept; without it the cases of the corpus are changed at random. A case
that raises anything but the user's error is written to ``FOLDER/found`` (default: build/fuzz/DOOR)
under the place at which it was raised, once for each place, and the search goes on; the exit status
is then 1. Put such a case, made small, into ``corpus/DOOR`` under a name that says what it shows:
test_fuzz_corpus.py reads all of them.
"""

from __future__ import annotations

import importlib.util
import io
import random
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[level]) for level in (0, 1, 2)]

import doors  # noqa: E402

#: of a case
MOST_BYTES = 20_000
MOST_SECONDS = 30
MOST_MB = 2048

ROOT = Path(__file__).resolve().parents[2]


def place_of(error: BaseException) -> str:
    """Where in the project an error was raised, as part of a file's name."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if "/tests/" not in frame.filename]
    own = [frame for frame in own if frame.filename.startswith(str(ROOT))] or list(frames)
    last = own[-1]
    return f"{type(error).__name__}-{Path(last.filename).stem}-{last.lineno}"


class Search:
    """Reads cases by a door, and keeps those that break it."""

    def __init__(self, name: str, folder: Path) -> None:
        self.found = folder / "found"
        self.found.mkdir(parents=True, exist_ok=True)
        self.opened = doors.Opened(name, Path(tempfile.mkdtemp(prefix="fuzz-")))

    def try_case(self, data: bytes) -> None:
        """Read a case; one that breaks the reader is kept."""
        from uxsim_geo.errors import InputError

        try:
            with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
                self.opened.read(data)
        except InputError:
            pass
        except Exception as error:  # noqa: BLE001  that is what is searched for
            path = self.found / place_of(error)
            if not path.exists():
                path.write_bytes(data)
                text = "".join(traceback.format_exception(error))
                path.with_name(f"{path.name}.txt").write_text(text, encoding="utf-8")
                sys.__stdout__.write(f"{path}: {error!r}\n"[:300])


def changed(data: bytes, others: list[bytes], rng: random.Random) -> bytes:
    """A case with some bytes, lines or words other than they were."""
    for _ in range(rng.randint(1, 4)):
        parts = data.split(sep) if (sep := rng.choice([b"\n", b",", b" ", b":", b""])) else [data]
        place = rng.randrange(len(parts))
        other = rng.choice(others)
        words = other.split(sep) if sep else [other[: rng.randint(1, 40)]]
        match rng.randrange(6):
            case 0:
                del parts[place]
            case 1:
                parts.insert(place, rng.choice(words))
            case 2:
                parts[place] = rng.choice(words)
            case 3:
                parts[place] = rng.choice(ODD)
            case 4:
                cut = rng.randrange(len(parts[place]) + 1)
                parts[place] = parts[place][:cut] + rng.randbytes(1) + parts[place][cut + 1 :]
            case 5:
                parts[place] = parts[place][: rng.randrange(len(parts[place]) + 1)]
        data = (sep or b"").join(parts)
    return data[:MOST_BYTES]


#: values that readers are rarely ready for
ODD = [
    *(b"", b"nan", b"inf", b"-inf", b"1e308", b"-1", b"0", b"1e-320", b"9" * 25, b"null", b"true"),
    *(b"[]", b"{}", b'""', b"\xff\xfe", b"\x00", "ä".encode("latin-1"), "１２".encode(), b"\r"),
]


def at_random(search: Search, cases: list[bytes], seconds: float) -> None:
    """Change cases at random, for so long."""
    rng, end = random.Random(0), time.monotonic() + seconds
    for case in cases:
        search.try_case(case)
    while time.monotonic() < end:
        search.try_case(changed(rng.choice(cases), cases, rng))


def guided(name: str, folder: Path, seconds: float) -> int:
    """Let atheris search, in processes of its own: where one breaks, the next goes on."""
    inputs = folder / "inputs"
    inputs.mkdir(parents=True, exist_ok=True)
    end, status = time.monotonic() + seconds, 0
    while (left := int(end - time.monotonic())) > 5:
        options = [f"-max_total_time={left}", f"-timeout={MOST_SECONDS}", f"-max_len={MOST_BYTES}"]
        options += [f"-rss_limit_mb={MOST_MB}", f"-artifact_prefix={folder}/found/", str(inputs)]
        options += [f"-dict={_words(name, folder)}", "-reload=0"]
        command = [sys.executable, __file__, "--guided", name, str(folder), *options]
        status |= subprocess.run(command, check=False, cwd=ROOT).returncode
    return status


def _words(name: str, folder: Path) -> Path:
    """What stands in the cases of a door, for the search to put in elsewhere."""
    found: dict[bytes, None] = dict.fromkeys(ODD)
    for case in corpus(name):
        if b"\0" not in case:
            found |= dict.fromkeys(case.replace(b"=", b" ").replace(b",", b" ").split())
    words = [word for word in found if 0 < len(word) <= 30]
    path = folder / "words"
    texts = ["".join(f"\\x{byte:02x}" for byte in word) for word in words[:600]]
    path.write_text("".join(f'"{text}"\n' for text in texts), encoding="ascii")
    return path


def corpus(name: str) -> list[bytes]:
    """The cases of a door that are kept."""
    return [path.read_bytes() for path in sorted((doors.CORPUS / name).glob("*"))]


def seeds(search: Search) -> list[bytes]:
    """What the search begins with: the cases that are kept, or what the door has made itself."""
    return corpus(search.opened.name) or list(search.opened.good.values())


def _guided_process(name: str, folder: Path, options: list[str]) -> None:
    import atheris

    with atheris.instrument_imports(include=["uxsim_geo", "pipeline"]):
        for module in _modules():
            importlib.import_module(module)
    search = Search(name, folder)
    inputs = folder / "inputs"
    for number, case in enumerate(seeds(search)):
        (inputs / f"kept-{number}").write_bytes(case)
    atheris.Setup([sys.argv[0], *options], search.try_case)
    atheris.Fuzz()


def _modules() -> Iterator[str]:
    """All that is written in Python and not compiled."""
    for package in ("uxsim_geo", "pipeline"):
        for path in sorted((ROOT / package).rglob("*.py")):
            parts = path.relative_to(ROOT).with_suffix("").parts
            if not {"engine", "__init__", "__main__", "space_time"} & set(parts):
                yield ".".join(parts)


def main(arguments: list[str]) -> int:
    """Search at a door; returns the exit status."""
    warnings.simplefilter("ignore")
    if arguments[0] == "--guided":
        _guided_process(arguments[1], Path(arguments[2]), arguments[3:])
        return 0
    name, seconds = arguments[0], float(arguments[1])
    folder = Path(arguments[2]) if len(arguments) > 2 else ROOT / "build/fuzz" / name
    if importlib.util.find_spec("atheris"):
        (folder / "found").mkdir(parents=True, exist_ok=True)
        guided(name, folder, seconds)
    else:
        search = Search(name, folder)
        at_random(search, seeds(search), seconds)
    found = sorted(path.name for path in (folder / "found").iterdir() if path.suffix != ".txt")
    sys.stdout.write(
        f"{name}: {len(found)} kinds of defects\n" + "".join(f"  {one}\n" for one in found)
    )
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
