"""Plain values as TOML: the inverse of `tomllib.loads` (the standard library reads TOML but writes none)."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any


def toml_text(values: Mapping[str, Any]) -> str:
    """TOML of tables, lists, strings, numbers and booleans, its tables under headings of their own.

    None, which TOML does not know, and tables and lists that hold nothing at the top are left out.
    """
    return (
        "\n".join(_lines({key: value for key, value in values.items() if value not in ({}, [])}, ())) + "\n"
    )


def _lines(table: Mapping[str, Any], path: tuple[str, ...]) -> list[str]:
    given = {key: value for key, value in table.items() if value is not None}
    lines = [f"{_key(key)} = {_inline(value)}" for key, value in given.items() if not _headed(value)]
    for key, value in given.items():
        if not _headed(value):
            continue
        name = ".".join(map(_key, (*path, key)))
        for entry, heading in (
            [(value, f"[{name}]")] if isinstance(value, Mapping) else [(e, f"[[{name}]]") for e in value]
        ):
            inner = _lines(entry, (*path, key))
            if not heading.startswith("[[") and inner and inner[0].startswith("["):
                lines += [*_gap(lines), *inner]  # a table of tables alone is made by their headings
            else:
                lines += [*_gap(lines), heading, *inner]
    return lines


def _gap(lines: list[str]) -> list[str]:
    return [""] if lines else []


def _headed(value: Any) -> bool:
    """Whether a value is written as a table, or a list of tables, under a heading."""
    if isinstance(value, list | tuple):
        return bool(value) and all(isinstance(entry, Mapping) for entry in value)
    return isinstance(value, Mapping)


def _inline(value: Any) -> str:
    if isinstance(value, Mapping):
        pairs = [f"{_key(key)} = {_inline(entry)}" for key, entry in value.items() if entry is not None]
        return f"{{ {', '.join(pairs)} }}" if pairs else "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_inline, value))}]"
    # Strings, numbers and booleans of JSON are TOML, but that TOML wants DEL escaped, and no surrogates.
    return json.dumps(value, ensure_ascii=False, allow_nan=False).replace("\x7f", "\\u007f")


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _inline(key)
