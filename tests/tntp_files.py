"""Small TNTP files for tests, written into a folder."""

from __future__ import annotations

from pathlib import Path

HEADER = (
    "~\tinit_node\tterm_node\tcapacity\tlength\tfree_flow_time\tb\tpower\tspeed\ttoll\tlink_type\t;"
)


def row(start: int, end: int, capacity: float = 1800, length: float = 1, time: float = 1) -> str:
    """A link as most files write it."""
    return f"\t{start}\t{end}\t{capacity}\t{length}\t{time}\t0.15\t4\t0\t0\t1\t;"


def net(rows: list[str], *, zones: int = 1, first: int = 1, header: str = HEADER) -> str:
    """A net file with as many links and nodes declared as there are."""
    fields = [line.replace("\t", " ").split() for line in rows]
    nodes = len({end for line in fields for end in line[:2]})
    return "\n".join(
        [
            f"<NUMBER OF ZONES> {zones}",
            f"<NUMBER OF NODES> {nodes}",
            f"<FIRST THRU NODE> {first}",
            f"<NUMBER OF LINKS> {len(rows)}",
            "<ORIGINAL HEADER>~\tInit node\tCapacity\t;",
            "<END OF METADATA>",
            "",
            header,
            *rows,
            "",
        ]
    )


def trips(blocks: str, *, total: str = "-", zones: int = 3) -> str:
    """A trips file of the blocks given; ``-`` declares no total."""
    head = f"<NUMBER OF ZONES> {zones}\n<TOTAL OD FLOW> {total}\n<END OF METADATA>\n\n"
    return head + blocks


def write(folder: Path, name: str, text: str) -> Path:
    """Write a text as it stands, line ends included."""
    path = folder / name
    path.write_bytes(text.encode())
    return path
