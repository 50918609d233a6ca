"""Open a dataset and read its samples one by one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.sim.dataset import store
from muslin.sim.dataset.frames import read_frame
from muslin.sim.dataset.header import Header, prepare_root, read_header
from muslin.sim.dataset.index import read_index, write_index
from muslin.sim.dataset.root import Root, open_root
from muslin.sim.dataset.sample import Sample


@dataclass(frozen=True, eq=False)
class Dataset:
    """Samples of a dataset, each read from disk when asked for.

    rows   one dict a sample, the columns of `index.COLUMNS` and `topologies`, in plan order
    """

    root: Root
    header: Header
    rows: tuple[dict[str, Any], ...]

    @cached_property
    def ids(self) -> tuple[str, ...]:
        return tuple(row["id"] for row in self.rows)

    @property
    def splits(self) -> tuple[str, ...]:
        """Names of the splits, in the order in which they appear."""
        return tuple(dict.fromkeys(row["split"] for row in self.rows))

    @property
    def missing(self) -> tuple[str, ...]:
        """Ids of planned samples that are not there (yet)."""
        return tuple(sample_id for sample_id in self.header.splits if sample_id not in self._known)

    @cached_property
    def _known(self) -> frozenset[str]:
        return frozenset(self.ids)

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[Sample]:
        return (self[sample_id] for sample_id in self.ids)

    def __contains__(self, sample_id: object) -> bool:
        return sample_id in self._known

    def __getitem__(self, key: str | int) -> Sample:
        """A sample by id or by place. Raises InputError for an unknown id and for a damaged sample."""
        sample_id = self.check_id(key)
        sample = store.read_sample(self.root, sample_id)
        return replace(sample, labels=sample.labels | {"split": self.header.splits.get(sample_id, "")})

    def frame(self, key: str | int, frame: int) -> NDArray[np.float32]:
        """(V_t, 3) float32 positions in one frame of a sample, metres, without reading the others.

        Raises InputError for an unknown id, a frame that is not there, and for damage to what was read.
        """
        return read_frame(self.root, self.check_id(key), frame)

    def check_id(self, key: str | int) -> str:
        """The id of a sample, by id or by place. Raises InputError for an unknown id."""
        sample_id = self.ids[key] if isinstance(key, int) else key
        if sample_id not in self:
            near = get_close_matches(sample_id, self.ids, n=3, cutoff=0.4) or self.ids[:3]
            raise InputError(f"{self.root}: has no sample {sample_id!r}; it has {', '.join(near)} …")
        return sample_id

    def split(self, name: str) -> Dataset:
        """The samples of one split. Raises InputError if there is no such split."""
        if name not in self.splits:
            raise InputError(f"{self.root}: has no split {name!r}; it has {', '.join(self.splits)}")
        return self.where(split=name)

    def where(self, **values: Any) -> Dataset:
        """The samples whose row has these values, e.g. `where(kind="drape", design="tshirt")`."""
        rows = tuple(row for row in self.rows if all(row[key] == value for key, value in values.items()))
        return replace(self, rows=rows)


def open_dataset(path: str | Path | Root) -> Dataset:
    """Open the dataset in a folder, or at a URL that fsspec knows.

    Raises InputError if it is none, or is damaged or of another schema.
    """
    root = open_root(path)
    header = read_header(root)
    return Dataset(root, header, read_index(root, header))


def write_dataset(
    path: str | Path | Root,
    samples: Iterable[Sample],
    config: dict[str, Any] | None = None,
    solver_digest: str = "",
) -> Dataset:
    """Write samples that were made elsewhere (one scene, predictions) as a dataset of their own.

    A sample's `labels["split"]`, if any, is its split. Raises InputError if the folder holds anything else,
    or a sample of the same id.
    """
    root = open_root(path)
    made = list(samples)
    splits = {sample.id: sample.labels.get("split", "") for sample in made}
    if len(splits) < len(made):
        raise InputError(f"{root}: two of the samples have the same id; give every sample an id of its own")
    header = Header(config=config or {}, splits=splits, solver_digest=solver_digest)
    prepare_root(root, header)
    with root.lock():
        for sample in made:
            if root.exists(store.sample_name(sample.id)):
                raise InputError(f"{root}: holds a sample {sample.id!r} already; write to another folder")
        header.write(root)
        root.clean()
        for sample in made:
            store.write_sample(root, sample)
        write_index(root, header)
    return open_dataset(root)
