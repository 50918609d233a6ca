"""What a family of metrics is: figures that are computed together, from the same data of a frame."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import asdict
from typing import Any, ClassVar, Self

import numpy as np

from muslin.eval.metrics.vertex import Statistics
from muslin.eval.read.pairing import Pair
from muslin.eval.score.frame import PairFrame

MM = 1000.0


class Family(ABC):
    """Sees the frames of one pair in order, and then adds up with those of other pairs.

    A new object a pair: what it keeps from frame to frame is its own.

    name     as chosen with --metrics
    what     what a note calls its figures when they are null
    notes    what a reader of the figures has to know
    """

    name: ClassVar[str]
    what: ClassVar[str]

    def __init__(self, pair: Pair) -> None:
        self.notes: list[str] = []

    @abstractmethod
    def update(self, frame: PairFrame) -> None:
        """Add a frame. UnavailableError if the pair lacks what is needed; the pair then has no figures."""

    @abstractmethod
    def merge(self, other: Self) -> None:
        """Add what another pair's object saw."""

    @abstractmethod
    def figures(self) -> dict[str, Any]:
        """JSON values by name, over all that was seen; None where there is no figure."""

    def frames(self) -> dict[str, list[Any]]:
        """JSON values frame by frame; a name that is left out has none."""
        return {}


class PairMeans:
    """Figures of which each frame has one, and all frames together their mean."""

    def __init__(self) -> None:
        self.values: dict[str, list[float]] = {}

    def add(self, **figures: float) -> None:
        for name, value in figures.items():
            self.values.setdefault(name, []).append(value)

    def merge(self, other: PairMeans) -> None:
        for name, values in other.values.items():
            self.values.setdefault(name, []).extend(values)

    def mean(self, name: str) -> float | None:
        """None if no frame came."""
        values = self.values.get(name)
        return float(np.mean(values)) if values else None


def scaled(statistics: Statistics | None, factor: float = 1.0) -> dict[str, float] | None:
    """The figures of a distribution by name, times a factor."""
    return None if statistics is None else statistics.scaled(factor)


def as_json(value: Any) -> dict[str, Any] | None:
    """A dataclass of figures by name, tuples as lists; None stays None."""
    if value is None:
        return None
    return {name: list(v) if isinstance(v, tuple) else v for name, v in asdict(value).items()}
