"""A summary of a dataset, from its index."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from muslin.sim.dataset.header import digest
from muslin.sim.dataset.progress import Status, read_status
from muslin.sim.dataset.quarantine import quarantined_ids, read_quarantined
from muslin.sim.dataset.reader import Dataset, open_dataset
from muslin.sim.dataset.root import Root
from muslin.sim.dataset.solver import solver_digest


@dataclass(frozen=True)
class DatasetInfo:
    """What a dataset holds.

    designs, shapes, sequences, fabrics, splits   {name: number of samples}
    remeshed                                      sequences whose topology changes
    vertices                                      (fewest, most) cloth vertices of a sample, in the frame that
                                                  has the most
    bytes                                         size of all samples on disk
    certificates                                  {figure: worst over all samples that measured it}
    unmeasured                                    {figure: samples whose certificate lacks it}
    seconds                                       computing time, summed over samples
    geometry_sha256                               equal exactly where two datasets hold the same geometry
    quarantined                                   {id: reason} of samples that were given up
    solver                                        "as installed", or "another": what is missing cannot be
                                                  made by what is installed here, and what is there is stale
    run                                           how far the last run of `generate` was, if that is known
    """

    name: str
    schema_version: int
    samples: int
    missing: int
    drapes: int
    sequences_made: int
    remeshed: int
    frames: int
    designs: dict[str, int]
    shapes: dict[str, int]
    sequences: dict[str, int]
    fabrics: dict[str, int]
    bodies: dict[str, int]
    splits: dict[str, int]
    vertices: tuple[int, int]
    bytes: int
    certificates: dict[str, float]
    unmeasured: dict[str, int]
    seconds: float
    versions: dict[str, str]
    geometry_sha256: str
    quarantined: dict[str, str]
    solver: str
    run: Status | None

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)


_WORST = {
    "cloth_cloth_intersections": max,
    "cloth_body_intersections": max,
    "masked_body_faces_max": max,
    "min_distance_m": min,
    "force_residual": max,
    "largest_strain": max,
}


def info(path: str | Path | Root) -> DatasetInfo:
    """Summarise the dataset in a folder. Raises InputError as `open_dataset`."""
    dataset = open_dataset(path)
    rows = dataset.rows
    measured = {key: [row[key] for row in rows if row[key] is not None] for key in _WORST}
    kinds = Counter(row["kind"] for row in rows)
    sizes = [row["vertices"] for row in rows] or [0]
    return DatasetInfo(
        name=str(dataset.header.config.get("name", str(dataset.root))),
        schema_version=dataset.header.schema_version,
        samples=len(rows),
        missing=len(dataset.missing),
        drapes=kinds["drape"],
        sequences_made=kinds["sequence"],
        remeshed=sum(row["topologies"] > 1 for row in rows),
        frames=sum(row["frames"] for row in rows),
        designs=_count(row["design"] for row in rows),
        shapes=_count(row["shape"] for row in rows),
        sequences=_count(row["sequence"] for row in rows),
        fabrics=_count(row["fabric"] for row in rows),
        bodies=_count(row["body"] for row in rows),
        splits=_count(row["split"] for row in rows),
        vertices=(min(sizes), max(sizes)),
        bytes=sum(row["bytes"] for row in rows),
        certificates={key: worst(measured[key]) for key, worst in _WORST.items() if measured[key]},
        unmeasured={key: n for key in _WORST if (n := len(rows) - len(measured[key]))},
        seconds=sum(row["seconds"] for row in rows),
        versions=dataset.header.versions,
        geometry_sha256=digest({row["id"]: row["geometry_sha256"] for row in rows}),
        quarantined={i: read_quarantined(dataset.root, i).reason for i in _held(dataset)},
        solver="as installed" if dataset.header.solver_digest == solver_digest() else "another",
        run=read_status(dataset.root),
    )


def _held(dataset: Dataset) -> list[str]:
    """Ids in quarantine of samples that are not there, in order."""
    return sorted(i for i in quarantined_ids(dataset.root) if i not in dataset)


def _count(names: Iterable[str]) -> dict[str, int]:
    return dict(Counter(name for name in names if name))
