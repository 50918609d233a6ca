"""Batches in an order that every process of a training draws alike."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class ShuffledBatches:
    """Places of `count` items, `batch` at a time (all, if there are fewer), in another order each epoch.

    What is left over when the batches do not divide the items waits for another epoch.
    """

    count: int
    batch: int
    seed: int

    @property
    def size(self) -> int:
        """Items of a batch, of all processes together."""
        return min(self.batch, self.count)

    @property
    def steps(self) -> int:
        """Batches of an epoch."""
        return self.count // self.size

    def places(self, epoch: int, rank: int, world: int) -> Iterator[NDArray[np.int64]]:
        """Those of one process of `world`, batch by batch."""
        order = np.random.default_rng([self.seed, epoch]).permutation(self.count)
        for step in range(self.steps):
            yield order[step * self.size : (step + 1) * self.size][rank::world]


def evenly(count: int, most: int) -> list[int]:
    """So many of `count` places at most, at even distances."""
    return [k * count // most for k in range(most)] if count > most else list(range(count))
