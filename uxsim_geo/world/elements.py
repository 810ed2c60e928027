"""What nodes and links have in common as scripts handle them.

An element holds no traffic. What is live is looked up in the simulation; what a script sets while
it runs is written to the levers of control.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from uxsim_geo.errors import Faults, InputError
from uxsim_geo.world import options, values

if TYPE_CHECKING:
    from uxsim_geo.world.roads import Roads
    from uxsim_geo.world.run import Run


class Element:
    """What nodes and links have in common."""

    __slots__ = ("W", "_user_function", "attribute", "id", "name", "user_attribute")

    #: what is told when it is added, and stays
    FIXED = frozenset({"W", "id", "name"})
    #: names that UXsim's users may look for, and what there is instead
    INSTEAD: Mapping[str, str] = MappingProxyType({})

    def __init__(self, world: Roads, name: str, number: int, own: dict[str, Any]) -> None:
        self.W = world
        self.name = name
        self.id = number
        self.attribute = own.get("attribute")
        self.user_attribute = own.get("user_attribute")
        self._user_function: Callable[[Any], object] | None = None

    def __setattr__(self, name: str, value: object) -> None:
        if name in self.FIXED and hasattr(self, name):
            raise AttributeError(f"{self!r}: {name} cannot be changed once it is there")
        try:
            object.__setattr__(self, name, value)
        except AttributeError:
            known = isinstance(getattr(type(self), name, None), property)
            what = "can be read but not set" if known else "is nothing that it has"
            advice = "" if known else "; data of your own belong into user_attribute"
            raise AttributeError(f"{self!r}: {name} {what}{advice}") from None

    def __getattr__(self, name: str) -> Any:
        # slots that are not filled yet come here too, and are no attributes then
        kind = type(self).__name__
        raise AttributeError(options.absent(kind, name, dir(type(self)), self.INSTEAD))

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name}>"

    @property
    def user_function(self) -> Callable[[Any], object] | None:
        """Called with this element at the end of every time step."""
        return self._user_function

    @user_function.setter
    def user_function(self, value: Callable[[Any], object] | None) -> None:
        faults = self._faults()
        found = values.user_function(faults, value)
        faults.raise_if_any()
        self._user_function = found
        self.W._functions.pop(self, None)
        if found is not None:
            self.W._functions[self] = found

    @property
    def _run(self) -> Run | None:
        return self.W._run

    def _faults(self) -> Faults:
        return Faults(f"{type(self).__name__.lower()} {self.name}")

    def _must_not_run(self, name: str) -> None:
        if self._run is not None:
            faults = self._faults()
            faults.add("cannot be changed once the scenario is final", column=name)
            faults.raise_if_any()


def unknown(kind: str, name: object, known: list[str]) -> InputError:
    """Return the error for an element that is not there, with the nearest that are."""
    import difflib

    near = difflib.get_close_matches(str(name), known, n=3)
    faults = Faults()
    advice = f": did you mean {' or '.join(near)}?" if near else ""
    faults.add(f"this world has no {kind} of that name{advice}", column=kind, value=name)
    return InputError(faults.found)
