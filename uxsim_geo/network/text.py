"""Text files from anywhere: whatever is wrong with the file itself becomes a fault."""

from __future__ import annotations

from pathlib import Path

from uxsim_geo.errors import Faults


def read_lines(path: Path, faults: Faults) -> list[str] | None:
    """The lines of a text file without their ends, or None with a fault that says why not.

    UTF-8 (of which ASCII is a part), with or without a byte-order mark; line ends of every
    system, so that item ``i`` is line ``i + 1`` of any editor.
    """
    text = read_text(path, faults)
    if text is None:
        return None
    if not text.strip():
        faults.add("is empty: is it the right file?")
        return None
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def read_text(path: Path, faults: Faults) -> str | None:
    """The text of a file in UTF-8 as it stands, without a byte-order mark; None with a fault."""
    data = read_bytes(path, faults)
    if data is None:
        return None
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        faults.add(
            f"is not a text file in UTF-8 (byte 0x{data[error.start]:02x}): is it the right file? "
            "If so, save it as UTF-8",
            line=line,
        )
        return None
    if "\0" in text:
        line = text[: text.index("\0")].count("\n") + 1
        faults.add("is a binary file, text was expected", line=line)
        return None
    return text


def read_bytes(path: Path, faults: Faults) -> bytes | None:
    """The content of a file, or None with a fault that says why it cannot be read."""
    try:
        return path.read_bytes()
    except FileNotFoundError:
        faults.add("there is no such file")
    except IsADirectoryError:
        faults.add("is a folder, a file was expected")
    except (OSError, ValueError) as error:
        faults.add(f"cannot be read: {error}")
    return None
