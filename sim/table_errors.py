"""What is wrong with a table of a file, in one sentence: key, value, what is allowed."""

from __future__ import annotations

import json
from collections.abc import Sequence
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, Tag

_Option = tuple[str | None, Any]
"""One of the types that a value may have, and the tag by which pydantic tells it from the others."""


def explain(entry: Any, root: type[BaseModel]) -> str:
    """A sentence for one entry of `ValidationError.errors()` of the model `root`."""
    location, options = _walk(entry["loc"], root)
    key = ".".join(location)
    value, reason = entry.get("input"), entry["msg"].removeprefix("Value error, ")
    if entry["type"] == "extra_forbidden":
        allowed = ", ".join(sorted(options[0][1].model_fields))
        return f"unknown key {key}; allowed here are {allowed}; correct or remove it"
    if entry["type"] == "missing":
        return f"{key} is missing; add it"
    if entry["type"] in ("union_tag_invalid", "union_tag_not_found"):
        key += "." + entry["ctx"]["discriminator"].strip("'")
        value = entry["ctx"].get("tag")
        reason = f"must be one of {', '.join(repr(tag) for tag, _ in options)}"
    shown = f"{key} = {json.dumps(value, default=str)}: " if key else ""
    return f"{shown}{reason}; correct it"


def _walk(location: Sequence[int | str], root: type[BaseModel]) -> tuple[list[str], list[_Option]]:
    """An error's location as the file has it, and the options of the last table, or value, on the way to it.

    Where a value may be one of several types, pydantic puts the tag of the chosen one into the location.
    """
    keys: list[str] = []
    options: list[_Option] = [(None, root)]
    for part in location:
        tagged = [option for option in options if option[0] == part and len(options) > 1]
        if tagged:
            options = tagged
            continue
        keys.append(str(part))
        model = options[0][1]
        field = model.model_fields.get(str(part)) if _is_table(model) and len(options) == 1 else None
        if field is not None:
            options = _options(field.annotation)
    return keys, options


def _is_table(option: Any) -> bool:
    return isinstance(option, type) and issubclass(option, BaseModel)


def _options(annotation: Any) -> list[_Option]:
    """The types that a value may have, or the entries of a list of them."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        tags = [mark.tag for mark in annotation.__metadata__ if isinstance(mark, Tag)]
        return [(tags[0] if tags else tag, option) for tag, option in _options(arguments[0])]
    if origin in (Union, UnionType):
        return [option for one in arguments if one is not type(None) for option in _options(one)]
    if origin is list:
        return _options(arguments[0])
    return [(_literal(annotation), annotation)]


def _literal(option: Any) -> str | None:
    """The one value of a table's key that has only one: its tag among others."""
    if not _is_table(option):
        return None
    values = [get_args(field.annotation) for field in option.model_fields.values()]
    kinds = [field.annotation for field in option.model_fields.values()]
    tags = [
        v[0] for v, kind in zip(values, kinds, strict=True) if get_origin(kind) is Literal and len(v) == 1
    ]
    return tags[0] if tags else None
