"""Displacements learned from displacements: the objective of R_smooth and R_fine."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from muslin.learn.drape.garment import PreparedGarment
from muslin.learn.graph.batch import GraphBatch, batch_pyramids
from muslin.learn.training.batches import ShuffledBatches


@dataclass(frozen=True, eq=False)
class Item:
    """One garment on one body: from where to where its vertices go, (V, 3) metres.

    beta (n,); fabric (f,), or None for a network that sees none.
    """

    garment: PreparedGarment
    beta: Tensor
    start: Tensor
    goal: Tensor
    fabric: Tensor | None = None


@dataclass(frozen=True, eq=False)
class Batch:
    """Items one after the other, on the device of the network."""

    start: Tensor
    goal: Tensor
    weights: Tensor
    beta: Tensor
    fabric: Tensor | None
    graphs: GraphBatch


def collate_items(items: Sequence[Item], device: torch.device | str = "cpu") -> Batch:
    """One batch of items of any topologies."""
    fabrics = [item.fabric for item in items if item.fabric is not None]
    return Batch(
        start=torch.cat([item.start for item in items]).to(device),
        goal=torch.cat([item.goal for item in items]).to(device),
        weights=torch.cat([item.garment.weights for item in items]).to(device),
        beta=torch.stack([item.beta for item in items]).to(device),
        fabric=torch.stack(fabrics).to(device) if fabrics else None,
        graphs=batch_pyramids([item.garment.pyramid for item in items], device),
    )


def displacement(model: nn.Module, batch: Batch) -> Tensor:
    """(V, 3) of all vertices of a batch, metres."""
    out: Tensor = model(batch.start, batch.weights, batch.beta, batch.graphs, batch.fabric)
    return out


class DisplacementObjective:
    """Mean over vertices of |d - (goal - start)|^2 / (3 s^2), s the spread of the goals' displacements.

    Source: Vidaurre 2024, chapter 4: squared displacement error; weight decay is the optimizer's.
    """

    def __init__(
        self,
        items: Sequence[Item],
        validation: Mapping[str, Sequence[Item]],
        *,
        batch: int,
        seed: int,
        spread: float,
        device: torch.device | str = "cpu",
    ) -> None:
        """validation: {name: items} whose mean vertex error is logged; batch: items of one;
        spread: s, metres."""
        self.items, self.validation = list(items), validation
        self.order, self.spread, self.device = ShuffledBatches(len(items), batch, seed), spread, device

    def steps(self) -> int:
        return self.order.steps

    def batches(self, epoch: int, rank: int, world: int) -> Iterator[Batch]:
        for places in self.order.places(epoch, rank, world):
            yield collate_items([self.items[k] for k in places], self.device)

    def loss(self, model: nn.Module, batch: Batch) -> Tensor:
        error = displacement(model, batch) - (batch.goal - batch.start)
        return (error / self.spread).square().mean()

    def validate(self, model: nn.Module) -> dict[str, float]:
        return {
            f"{name}_mm": 1e3 * float(np.mean([float(d) for d in self._errors(model, items)]))
            for name, items in self.validation.items()
        }

    def _errors(self, model: nn.Module, items: Sequence[Item]) -> Iterator[Tensor]:
        for first in range(0, len(items), self.order.size):
            some = items[first : first + self.order.size]
            batch = collate_items(some, self.device)
            error = (displacement(model, batch) - (batch.goal - batch.start)).norm(dim=1)
            yield from (part.mean() for part in error.split([len(item.start) for item in some]))

    def identity(self) -> dict[str, Any]:
        sha = hashlib.sha256()
        for item in self.items:
            for values in (item.start, item.goal, item.beta):
                sha.update(values.numpy().tobytes())
        return {"items": len(self.items), "batch": self.order.size, "data": sha.hexdigest()}
