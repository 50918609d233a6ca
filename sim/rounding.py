"""Positions on a grid of less than 1e-5 m: what lies on it is stored in half the room."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from muslin.sim.dataset.remeshed import RemeshedSequence
from muslin.sim.dataset.sample import Sample

STEP_M = 2.0**-17
"""Step of the grid, 7.6e-6 m; a power of two, so that its points within 128 m of the origin are float32."""

MAX_ERROR_M = float(np.sqrt(3.0)) * STEP_M / 2.0
"""How far a vertex moves at most, 6.6e-6 m."""


def to_grid(positions: NDArray[np.floating]) -> NDArray[np.float32]:
    """The nearest points x' = s round(x / s) of the grid, s = STEP_M, of positions (..., 3), metres."""
    return (np.round(np.asarray(positions, dtype=np.float64) / STEP_M) * STEP_M).astype(np.float32)


def round_sample(sample: Sample) -> Sample:
    """A sample with all its cloth on the grid. Cloth that was apart by less than 2 MAX_ERROR_M may cross."""
    if isinstance(sample, RemeshedSequence):
        return replace(sample, frames=tuple(to_grid(frame) for frame in sample.frames))
    return replace(sample, positions=to_grid(sample.positions))
