"""What a layout is: how one sample is written, and what is written of them all."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from muslin.sim.dataset.reader import Dataset
from muslin.sim.dataset.sample import Sample

Facts = dict[str, Any]


def nothing_more(dataset: Dataset, facts: Sequence[Mapping[str, Any]], out: Path) -> None:
    """What most layouts write of all samples together."""


@dataclass(frozen=True)
class Layout:
    """One way of laying out samples.

    write          (sample, folder, out, body) writes the files of a sample into an empty folder, or beside
                   others' below `out`, with or without what the cloth lies on; returns facts for meta.json
    finish         (dataset, facts, out) writes what goes over all exported samples, given their meta.json
    any_topology   whether it can hold samples whose topology changes
    """

    write: Callable[[Sample, Path, Path, bool], Facts]
    finish: Callable[[Dataset, Sequence[Mapping[str, Any]], Path], None] = nothing_more
    any_topology: bool = False
