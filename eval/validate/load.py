"""The files of the cases: scenes/validation/*.toml."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from muslin.eval.validate.case import CaseTable
from muslin.eval.validate.catalogue import CASES
from muslin.garments.errors import InputError
from muslin.sim.table_errors import explain
from muslin.sim.toml_values import read_values


@dataclass(frozen=True)
class LoadedCase:
    """A case with the parameters of its file."""

    name: str
    table: CaseTable


def load_cases(folder: Path, small: bool, only: str | None = None) -> list[LoadedCase]:
    """The cases of a folder in the order of the catalogue; with `small`, as their [small] tables change them.

    A file is named after its case. Raises InputError for a folder without files, an unknown case, a wrong
    value.
    """
    files = {path.stem: path for path in sorted(folder.glob("*.toml"))}
    if not files:
        raise InputError(
            f"{folder}: holds no case; give the folder scenes/validation of muslin's repository with --scenes"
        )
    unknown = [path.name for name, path in files.items() if name not in CASES]
    if unknown:
        raise InputError(
            f"{folder}: {', '.join(unknown)} name no case; cases are "
            f"{', '.join(CASES)}: rename or remove the file"
        )
    if only is not None and only not in files:
        raise InputError(f"--case {only!r}: not in {folder}; choose one of {', '.join(files)}")
    names = [name for name in CASES if name in files and only in (None, name)]
    return [LoadedCase(name, load_case(files[name], small)) for name in names]


def load_case(path: Path, small: bool) -> CaseTable:
    """The parameters of one case. Raises InputError."""
    values = read_values(path, "validation case", (), "bar=0.02")
    changes = values.pop("small", {})
    if small:
        values |= changes
    table = CASES[path.stem].table
    try:
        return table.model_validate(values)
    except ValidationError as error:
        raise InputError(f"{path}: {explain(error.errors()[0], table)}") from error
