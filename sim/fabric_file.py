"""Fabrics of one's own: files in the form of `sim/assets/wang2011_fabrics.toml`."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Annotated

from pydantic import Field, ValidationError

from muslin.garments.errors import InputError
from muslin.sim.material import Fabric, fabric_from_table
from muslin.sim.table_errors import explain
from muslin.sim.tables import Finite, NotNegative, Positive, Table

Moduli = tuple[Finite, Finite, Finite, Finite]
Bend = tuple[NotNegative, NotNegative, NotNegative, NotNegative, NotNegative]


class FabricTable(Table):
    """One fabric of a file; the head of `sim/assets/wang2011_fabrics.toml` explains the keys.

    `stretch_strained` is left out where a fabric keeps its stiffness as it stretches, and a `bend` of one
    row where it bends alike in every direction.
    """

    description: str = ""
    density: Positive
    stretch_rest: Moduli
    stretch_strained: Annotated[list[Moduli], Field(min_length=5, max_length=5)] | None = None
    bend: Annotated[list[Bend], Field(min_length=1, max_length=3)]


def is_fabric_file(reference: str) -> bool:
    """Whether the `fabric` of a scene means a file: FILE.toml or FILE.toml:NAME."""
    return ".toml" in reference


def read_fabric(reference: str) -> Fabric:
    """The fabric of `FILE.toml`, which holds one, or `FILE.toml:NAME`. InputError where that cannot be."""
    path, _, name = reference.partition(".toml")
    path, name = path + ".toml", name.removeprefix(":")
    try:
        tables = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"fabric file {path}: not readable ({error}); give a TOML file") from error
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"fabric file {path}: not TOML ({error}); correct the file") from error
    if not name and len(tables) == 1:
        (name,) = tables
    if name not in tables:
        raise InputError(
            f"fabric = {reference!r}: choose one of {', '.join(sorted(tables)) or 'none'} as {path}:NAME"
        )
    try:
        table = FabricTable.model_validate(tables[name])
    except ValidationError as error:
        raise InputError(f"fabric {path}:{name}: {explain(error.errors()[0], FabricTable)}") from error
    if len(table.bend) == 2:
        raise InputError(f"fabric {path}:{name}: bend has 2 rows; give 1, or 3 for 0, 45 and 90 degrees")
    strained = table.stretch_strained or [table.stretch_rest] * 5
    bend = table.bend * 3 if len(table.bend) == 1 else table.bend
    entry = {"density": table.density, "stretch_rest": table.stretch_rest}
    return fabric_from_table(name, entry | {"stretch_strained": strained, "bend": bend})
