"""What anything learned must beat: the nearest drape of the training set, and the mean drape on the skin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from muslin.garments.correspondence import Correspondence
from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.learn.drape.dense import DenseDrapes, dense_drapes
from muslin.learn.drape.examples import read_examples
from muslin.learn.drape.garment import PreparedGarment
from muslin.learn.drape.pipeline import DrapePipeline
from muslin.learn.drape.world import Draper, World, shape_tensor
from muslin.sim.dataset.reader import Dataset
from muslin.sim.dataset.selection import select


class NearestDrape:
    """The drape of the training set whose design and shape are nearest, at the same places of the pattern.

    Nearest in parameters and shape, each over its spread in the training set; of the same fabric.
    """

    def __init__(self, drapes: DenseDrapes) -> None:
        self.known, self.world = drapes, drapes.world
        features = torch.cat([drapes.parameters, drapes.betas], dim=1)
        self.width = features.std(0, correction=0).clamp_min(1e-6)
        self.features = features / self.width

    def prepare(self, mesh: GarmentMesh) -> tuple[GarmentMesh, Correspondence]:
        return mesh, self.known.place(mesh)

    def drapes(
        self,
        garments: Sequence[tuple[GarmentMesh, Correspondence]],
        betas: Sequence[Any],
        fabrics: Sequence[str],
    ) -> list[Tensor]:
        found = []
        for (mesh, place), beta, fabric in zip(garments, betas, fabrics, strict=True):
            nearest = self.known.positions[self._nearest(mesh, beta, fabric)]
            found.append(torch.from_numpy(place.carry(nearest.numpy()).astype(np.float32)))
        return found

    def _nearest(self, mesh: GarmentMesh, beta: Any, fabric: str) -> int:
        own = torch.tensor([name == fabric for name in self.known.fabrics])
        if not own.any():
            raise InputError(f"fabric {fabric!r}: the training set has {', '.join(set(self.known.fabrics))}")
        shape = shape_tensor(beta, self.known.betas.shape[1])
        asked = torch.cat([torch.tensor([mesh.parameters[name] for name in self.known.names]), shape])
        distance = (self.features - asked / self.width).square().sum(1)
        return int(torch.where(own, distance, torch.inf).argmin())


@dataclass(frozen=True, eq=False)
class SkinnedMean:
    """The mean drape of R_mean, every vertex moved as the skin nearest to it is by the change of shape."""

    pipeline: DrapePipeline

    @property
    def world(self) -> World:
        return self.pipeline.world

    def prepare(self, mesh: GarmentMesh) -> PreparedGarment:
        return self.pipeline.prepare(mesh)

    def drapes(
        self, garments: Sequence[PreparedGarment], betas: Sequence[Any], fabrics: Sequence[str]
    ) -> list[Tensor]:
        return [garment.skinned(beta) for garment, beta in zip(garments, betas, strict=True)]


def baseline_of(draper: Draper[Any], kind: str, dataset: Dataset) -> Draper[Any]:
    """A baseline by its name: "mean-on-skin" of a pipeline, or "nearest" in the training set of a dataset.

    Raises InputError for another name, and for the mean drape of networks that have none.
    """
    if kind == "nearest":
        return NearestDrape(dense_drapes(read_examples(select(dataset, "train"))))
    if kind != "mean-on-skin":
        raise InputError(f"baseline {kind!r}: there are mean-on-skin and nearest")
    if not isinstance(draper, DrapePipeline):
        raise InputError("mean-on-skin needs R_mean: give the folder of a pipeline")
    return SkinnedMean(draper)
