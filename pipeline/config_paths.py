"""Paths in values that come from another file than the configuration: made absolute."""

from __future__ import annotations

import typing
from pathlib import Path

from pydantic import BaseModel

from pipeline.config_file import iterate_keys, sections_in
from pipeline.config_keys import POLYGON
from uxsim_geo.network.wkt import LINE


def rebased(value: object, keys: list[str], folder: Path) -> object:
    """Return a value of a key, with paths in it from ``folder`` on; unknown keys stay as they are.

    ``keys``: from the top of a configuration, positions in lists among them.
    """
    dotted = ".".join(key for key in keys if not key.isdecimal())
    found = dict(iterate_keys()).get(dotted)
    return value if found is None else _rebased(value, found.annotation, folder)


def _rebased(value: object, annotation: object, folder: Path) -> object:
    if isinstance(value, str):
        is_path = _holds_path(annotation) and not (POLYGON.match(value) or LINE.match(value))
        return str(folder / value) if is_path and not value.startswith("~") else value
    if isinstance(value, list):
        return [_rebased(one, annotation, folder) for one in value]
    if isinstance(value, dict):
        keys = {
            key.alias or name: key.annotation
            for section in sections_in(annotation)
            for name, key in section.model_fields.items()
        }
        return {key: _rebased(one, keys.get(key), folder) for key, one in value.items()}
    return value


def _holds_path(annotation: object) -> bool:
    """Tell whether a key may be a path itself, not only in its sections."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return False
    return annotation is Path or any(map(_holds_path, typing.get_args(annotation)))
