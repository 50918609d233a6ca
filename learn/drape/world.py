"""What drapes were learned in, outside of which nothing learned from them is good for anything."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.sim.body.load import load_body
from muslin.sim.body.model import BodyModel
from muslin.sim.dataset.sample import Sample

Prepared = TypeVar("Prepared")


@dataclass(frozen=True)
class World:
    """design: family of garments; body: name of the model, with its digest; theta: (24, 3) the pose, as
    lists; fabrics: names."""

    design: str
    body: str
    digest: str
    theta: list[list[float]]
    fabrics: tuple[str, ...]

    @staticmethod
    def of(values: Mapping[str, Any]) -> World:
        """The inverse of `dataclasses.asdict`, by way of JSON."""
        return World(**{**values, "fabrics": tuple(values["fabrics"])})

    def load_body(self) -> BodyModel:
        """Raises InputError if it is not the same model any more."""
        return same_body(self.body, self.digest)

    def check(self, sample: Sample) -> None:
        """Raise InputError for a sample of another world."""
        body = sample.body
        wrong: Sequence[tuple[str, Any, Any]] = (
            ("kind", sample.kind, "drape"),
            ("design", sample.frame_garment(0).name, self.design),
            ("body model", None if body is None else body.digest, self.digest),
            ("pose", None if body is None else body.poses[0].tolist(), self.theta),
        )
        for what, found, known in wrong:
            if found != known:
                raise InputError(
                    f"sample {sample.id} has another {what} than what was learned from; select samples "
                    "like that"
                )


def same_body(name: str, digest: str) -> BodyModel:
    """The body of a name. Raises InputError if it is not the one of this digest."""
    model = load_body(name)
    if model.digest != digest:
        raise InputError(
            f"body {name!r} is not the one that was learned from; put that file back, or train anew"
        )
    return model


def in_body_frame(sample: Sample) -> NDArray[np.float32]:
    """(V, 3) positions of a drape as if its body were at the origin, metres: bodies of different shapes
    stand on one floor, so their translations differ."""
    assert sample.body is not None
    return (sample.positions[0] - sample.body.translations[0]).astype(np.float32)


def shape_tensor(beta: Any, count: int) -> Tensor:
    """Shape coefficients as (count,) float32: cut there, or zeros from where they end."""
    given = torch.as_tensor(np.asarray(beta, dtype=np.float32))[:count]
    return torch.nn.functional.pad(given, (0, count - len(given)))


class Draper(Protocol[Prepared]):
    """Anything that drapes garments: the graph networks, and what they are compared with."""

    @property
    def world(self) -> World:
        """What it was learned in."""

    def prepare(self, mesh: GarmentMesh) -> Prepared:
        """Once a triangulation. Raises InputError for a garment that it cannot drape."""

    def drapes(
        self, garments: Sequence[Prepared], betas: Sequence[Any], fabrics: Sequence[str]
    ) -> list[Tensor]:
        """Drapes (V, 3) of the garments on bodies of these shapes, in these fabrics, metres, with the body at
        the origin (`in_body_frame`).

        Raises InputError for a fabric that it does not know.
        """
