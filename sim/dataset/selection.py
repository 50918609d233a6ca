"""Part of a dataset, by what its rows say."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from muslin.garments.errors import InputError
from muslin.sim.dataset.reader import Dataset, open_dataset
from muslin.sim.dataset.root import Root


def select(
    dataset: Dataset | str | Path | Root,
    split: str | None = None,
    where: Mapping[str, Any] | None = None,
    ids: Iterable[str] | None = None,
) -> Dataset:
    """The samples of a dataset, or of its folder, that are asked for; all of them if nothing is.

    split   those of this split
    where   those with these values in their row of the index, e.g. {"design": "tshirt", "topologies": 1};
            a number may be given as text, and of a text a pattern such as "walk*"
    ids     these, in this order

    Raises InputError for a split, column or id that is not there, and if no sample is left.
    """
    chosen = dataset if isinstance(dataset, Dataset) else open_dataset(dataset)
    if not len(chosen):
        raise InputError(f"{chosen.root}: the dataset holds no sample; run `muslin generate` first")
    if ids is not None:
        rows = {row["id"]: row for row in chosen.rows}
        asked = [chosen.check_id(sample_id) for sample_id in dict.fromkeys(ids)]
        chosen = replace(chosen, rows=tuple(rows[sample_id] for sample_id in asked))
    if split is not None:
        chosen = chosen.split(split)
    columns = sorted(chosen.rows[0]) if len(chosen) else []
    for key, value in (where or {}).items():
        if key not in columns:
            raise InputError(f"{chosen.root}: samples have no {key!r}; they have {', '.join(columns)}")
        found = tuple(row for row in chosen.rows if _equal(row[key], value))
        if not found:
            there = list(dict.fromkeys(str(row[key]) for row in chosen.rows))
            raise InputError(
                f"{chosen.root}: no sample has {key}={value}; there is {', '.join(there[:6])}"
                + (" …" if len(there) > 6 else "")
            )
        chosen = replace(chosen, rows=found)
    return chosen


def _equal(stored: Any, asked: Any) -> bool:
    if isinstance(stored, (int, float)) and isinstance(asked, str):
        try:
            return stored == float(asked)
        except ValueError:
            return False
    if isinstance(stored, str) and isinstance(asked, str):
        return fnmatchcase(stored, asked)
    return bool(stored == asked)
