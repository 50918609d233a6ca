"""Presets of a dataset's file: variants of it, such as a small one that is made in minutes.

[presets.small]                                 # `muslin generate FILE --preset small`
shapes = [{ name = "beta", sweep = { component = 0, start = -3.0, stop = 3.0, count = 9 } }]
scene.garment.template = 1400
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from muslin.garments.errors import InputError


def with_preset(values: Mapping[str, Any], preset: str | None, source: str) -> dict[str, Any]:
    """The values of a file without its presets, those of `preset`, if any, merged over them.

    Tables are merged key by key, at any depth; everything else, lists too, takes the place of what was there.
    Raises InputError for a preset that the file has not.
    """
    base = {key: value for key, value in values.items() if key != "presets"}
    presets = values.get("presets", {})
    if not isinstance(presets, Mapping) or not all(isinstance(table, Mapping) for table in presets.values()):
        raise InputError(f"{source}: presets: must be tables [presets.NAME]")
    if preset is None:
        return base
    if preset not in presets:
        there = f"there are {', '.join(presets)}" if presets else "the file has none"
        raise InputError(f"{source}: no preset {preset!r}; {there}")
    return _merged(base, presets[preset])


def _merged(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    result = dict(base)
    for key, value in over.items():
        before = result.get(key)
        both = isinstance(before, Mapping) and isinstance(value, Mapping)
        result[key] = _merged(before, value) if both else value  # type: ignore[arg-type]
    return result
