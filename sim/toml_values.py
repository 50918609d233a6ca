"""The values of a TOML file, with `key=value` overrides from the command line."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from muslin.garments.errors import InputError


def read_values(path: str | Path, kind: str, overrides: Sequence[str], example: str) -> dict[str, Any]:
    """The values of the TOML file of a `kind`, each of `overrides` applied by `set_value`.

    Raises InputError where the file cannot be read or is no TOML.
    """
    try:
        values = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not readable ({error}); give the TOML file of a {kind}") from error
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: not TOML ({error}); correct the file") from error
    for override in overrides:
        set_value(values, override, example)
    return values


def set_value(values: dict[str, Any], override: str, example: str) -> None:
    """Apply `key=value` to the values of a TOML file, in place.

    Dots in the key lead into tables, numbers to places in lists (`shapes.0.beta`); tables that are not there
    are made. The value is TOML; a bare word is a string. Raises InputError, which shows `example` where the
    form is wrong.
    """
    key, equals, text = override.partition("=")
    if not equals or not key.strip():
        raise InputError(f"--set {override!r}: must be key=value, for example {example}")
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        value = text.strip()
    table: Any = values
    *path, last = key.strip().split(".")
    for part in path:
        table = _enter(table, part, override)
    if isinstance(table, list):
        table[_place(table, last, override)] = value
    else:
        table[last] = value


def _enter(table: Any, part: str, override: str) -> Any:
    entry = table[_place(table, part, override)] if isinstance(table, list) else table.setdefault(part, {})
    if not isinstance(entry, dict | list):
        raise InputError(f"--set {override!r}: {part} is a value, not a table; give the key of a value")
    return entry


def _place(table: list[Any], part: str, override: str) -> int:
    if not part.isdigit() or int(part) >= len(table):
        raise InputError(f"--set {override!r}: {part} must be a place from 0 to {len(table) - 1} in the list")
    return int(part)
