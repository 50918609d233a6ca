"""What a model of animated garments must beat: no displacement at all, and the nearest frame that it saw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.learn.wrinkles.clips import Clip, Told, read_clips
from muslin.learn.wrinkles.condition import Condition
from muslin.learn.wrinkles.garment import GarmentCache
from muslin.learn.wrinkles.model import WrinkleModel
from muslin.learn.wrinkles.world import SequenceWorld
from muslin.sim.dataset.reader import Dataset
from muslin.sim.dataset.selection import select


@dataclass(frozen=True, eq=False)
class _OfModel:
    """What a baseline has of the model beside which it is measured: all but how maps come about."""

    model: WrinkleModel

    @property
    def world(self) -> SequenceWorld:
        return self.model.world

    @property
    def condition(self) -> Condition:
        return self.model.condition

    @property
    def garments(self) -> GarmentCache:
        return self.model.garments


class SkinnedTemplate(_OfModel):
    """The template of G_design on the skin, nothing else."""

    def maps(self, sequences: Sequence[Told], seed: int = 0) -> list[NDArray[np.float32]]:
        count = int(self.model.network.mask.sum())
        return [np.zeros((len(told), count, 3), np.float32) for told in sequences]


@dataclass(frozen=True, eq=False)
class NearestFrame(_OfModel):
    """In every frame the map of the training frame with the nearest condition, over its spread."""

    clips: Sequence[Clip]

    def maps(self, sequences: Sequence[Told], seed: int = 0) -> list[NDArray[np.float32]]:
        width = self.model.network.width
        known = torch.from_numpy(np.concatenate([clip.told.conditions for clip in self.clips])) / width
        frames = [(clip, t) for clip in self.clips for t in range(len(clip))]
        found = []
        for told in sequences:
            nearest = torch.cdist(torch.from_numpy(told.conditions) / width, known).argmin(dim=1).tolist()
            found.append(np.stack([frames[place][0].maps[frames[place][1]] for place in nearest]))
        return found


def baseline_of(model: WrinkleModel, kind: str, dataset: Dataset) -> SkinnedTemplate | NearestFrame:
    """A baseline by its name: "template-on-skin", or "nearest" in the training set of a dataset.

    Raises InputError for another name.
    """
    if kind == "template-on-skin":
        return SkinnedTemplate(model)
    if kind != "nearest":
        raise InputError(f"baseline {kind!r}: there are template-on-skin and nearest")
    return NearestFrame(model, read_clips(select(dataset, "train"), model.garments, model.condition))
