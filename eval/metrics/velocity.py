"""Errors of vertex velocities: what jitter shows up in and positions hide."""

from __future__ import annotations

import numpy as np

from muslin.eval.metrics.vertex import vertex_errors
from muslin.garments.errors import InputError


def velocities(positions: np.ndarray, fps: float) -> np.ndarray:
    """v_t = (x_{t+1} - x_t) fps: forward differences of a sequence.

    positions (T, V, 3), metres, T >= 2; fps: frames per second of the file; returns (T - 1, V, 3), m/s.
    Raises InputError for fewer than two frames or a rate that is not positive.
    """
    if positions.ndim != 3 or len(positions) < 2:
        raise InputError(f"velocities need positions of shape (T >= 2, V, 3), got {positions.shape}")
    if not (np.isfinite(fps) and fps > 0):
        raise InputError(f"velocities: fps = {fps} is not allowed; it must be a positive number")
    return np.diff(positions.astype(np.float64), axis=0) * fps


def velocity_errors(prediction: np.ndarray, truth: np.ndarray, fps: float) -> np.ndarray:
    """|v_i - w_i| of corresponding vertices of two sequences at one frame rate; (T - 1, V), m/s.

    A constant offset in space costs nothing here; an offset that jumps by d from one frame to the next costs
    d fps.
    """
    return vertex_errors(velocities(prediction, fps), velocities(truth, fps))
