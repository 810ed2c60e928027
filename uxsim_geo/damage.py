"""Files that a library reads: whatever it raises of their content becomes a fault.

Arrow, GDAL, GEOS, PROJ and what stands on them raise nearly anything for a damaged file, depending
on the place of the damage. Only the call of the library belongs into the ``with``.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from uxsim_geo.errors import Faults, InputError

#: what of a library's own words is told
_MOST = 200


@contextmanager
def damage_as_fault(faults: Faults, what: str) -> Iterator[None]:
    """Note ``what`` is wrong, with the library's words, if the file cannot be read."""
    import pyarrow as pa
    import shapely

    try:
        yield
    except InputError:
        raise
    except FileNotFoundError:
        faults.add("there is no such file")
    except (
        ArithmeticError,
        AttributeError,
        LookupError,
        MemoryError,
        OSError,
        RuntimeError,  # those of GDAL and PROJ, and what is nested too deeply
        TypeError,
        ValueError,
        pa.ArrowException,
        shapely.errors.ShapelyError,
    ) as error:
        faults.add(f"{what}; is it the right file, and whole? ({_in_a_line(error)})")


def _in_a_line(error: BaseException) -> str:
    """The first line of what a library says; its kind of error, if it says nothing."""
    lines = str(error).strip().splitlines()
    text = lines[0].strip() if lines else type(error).__name__
    # GDAL goes on with what only helps who writes Python
    text = text.partition("; It might help")[0]
    return text if len(text) <= _MOST else f"{text[: _MOST - 1]}…"
