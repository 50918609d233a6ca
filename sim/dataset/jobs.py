"""What a plan consists of: jobs in chains."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Job:
    """One sample to make: the values of its scene, and an id that ends in a hash of all that makes its
    geometry."""

    id: str
    kind: str
    scene: dict[str, Any]
    labels: dict[str, str]
    split: str
    seed: int


@dataclass(frozen=True)
class Chain:
    """Jobs of one process: drapes along beta, each simulation starting from the one before, or one sequence.

    Drapes that differ in nothing but the topology fitted to them stand side by side: one simulation."""

    jobs: tuple[Job, ...]


@dataclass(frozen=True)
class Plan:
    chains: tuple[Chain, ...]

    @property
    def jobs(self) -> tuple[Job, ...]:
        return tuple(job for chain in self.chains for job in chain.jobs)

    @property
    def splits(self) -> dict[str, str]:
        """{sample id: split}, in plan order."""
        return {job.id: job.split for job in self.jobs}
