"""Metrics frame by frame: feed frames, read the figures of all of them at the end."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from muslin.eval.metrics.vertex import Statistics, statistics


@dataclass
class ErrorAccumulator:
    """Collects per-vertex errors of frames; statistics over every vertex of every frame.

    Quantiles need all values, so they are kept (float32: 16 kB a frame at 4,000 vertices).
    """

    errors: list[np.ndarray] = field(default_factory=list)
    weights: list[np.ndarray] = field(default_factory=list)

    def update(self, errors: np.ndarray, weights: np.ndarray | None = None) -> None:
        """errors (V,), weights (V,) or None for equal ones."""
        self.errors.append(errors.astype(np.float32))
        self.weights.append(
            np.ones(errors.shape, np.float32) if weights is None else weights.astype(np.float32)
        )

    def merge(self, other: ErrorAccumulator) -> None:
        """Add the frames of another."""
        self.errors += other.errors
        self.weights += other.weights

    def weighted_means(self, factor: float = 1.0) -> list[float]:
        """Mean of each frame by the weights given, times a factor."""
        pairs = zip(self.errors, self.weights, strict=True)
        return [factor * float(np.average(e, weights=w)) for e, w in pairs]

    def result(self) -> Statistics | None:
        """Plain statistics; None if no frame came."""
        return statistics(np.concatenate(self.errors)) if self.errors else None

    def weighted_result(self) -> Statistics | None:
        """Statistics by the weights given; None if no frame came."""
        if not self.errors:
            return None
        return statistics(np.concatenate(self.errors), np.concatenate(self.weights))
