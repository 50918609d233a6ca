"""What sequences were learned in, outside of which nothing learned from them is good for anything."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from muslin.garments.errors import InputError
from muslin.learn.drape.world import same_body
from muslin.sim.body.model import BodyModel
from muslin.sim.dataset.reader import Dataset
from muslin.sim.dataset.sample import BodyTrack, Sample


@dataclass(frozen=True)
class SequenceWorld:
    """design: family of garments; body: name of the model, with its digest; fabrics: names; fps: frames a
    second, at which a frame follows its previous one."""

    design: str
    body: str
    digest: str
    fabrics: tuple[str, ...]
    fps: float

    @staticmethod
    def of(values: Mapping[str, Any]) -> SequenceWorld:
        """The inverse of `dataclasses.asdict`, by way of JSON."""
        return SequenceWorld(**{**values, "fabrics": tuple(values["fabrics"])})

    def load_body(self) -> BodyModel:
        """Raises InputError if it is not the same model any more."""
        return same_body(self.body, self.digest)

    def check(self, sample: Sample) -> BodyTrack:
        """The body of a sample. Raises InputError for a sample of another world."""
        body = sample.body
        for what, found, known in (
            ("kind", sample.kind, "sequence"),
            ("design", sample.frame_garment(0).name, self.design),
            ("number of meshes", len(sample.garments), 1),
            ("body model", None if body is None else body.digest, self.digest),
            ("rate of frames", sample.fps, self.fps),
        ):
            if found != known:
                raise InputError(
                    f"sample {sample.id} has another {what}, {found}, than what is learned from, {known}; "
                    "select samples like that"
                )
        if sample.fabric not in self.fabrics:
            raise InputError(f"fabric {sample.fabric!r}: {', '.join(self.fabrics)} were learned")
        assert body is not None
        return body


def world_of(dataset: Dataset) -> SequenceWorld:
    """That of the first sequence of a dataset, with the fabrics of all.

    Raises InputError if there is none, or it is on no parametric body.
    """
    if not len(dataset):
        raise InputError(f"{dataset.root}: no sequence is left to learn from")
    sample = dataset[0]
    if sample.body is None or sample.fps is None:
        raise InputError(
            f"sample {sample.id} is no sequence on a parametric body; select sequences on one (`muslin info`)"
        )
    fabrics = tuple(dict.fromkeys(row["fabric"] for row in dataset.rows))
    return SequenceWorld(
        sample.frame_garment(0).name, sample.body.model, sample.body.digest, fabrics, sample.fps
    )
