"""Errors of velocity, acceleration and jerk, and the jitter of a sequence: what positions hide."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from muslin.eval.metrics.checks import check_rate, checked_pair, checked_points
from muslin.garments.errors import InputError

NAMES = {1: "velocity", 2: "acceleration", 3: "jerk"}


@dataclass(frozen=True)
class Jitter:
    """Mean jerk of a prediction and of the truth, m/s^3, and the first over the second.

    ratio   1 moves as smoothly as the truth, more trembles, less is damped; None where the truth does not
            move and no ratio exists
    """

    prediction: float
    truth: float
    ratio: float | None


def derivatives(positions: np.ndarray, fps: float, order: int) -> np.ndarray:
    """Time derivative of a given order, 1 to 3, by differences of order + 1 frames.

        v_t = (x_{t+1} - x_t) fps,    a_t = (v_{t+1} - v_t) fps,    j_t = (a_{t+1} - a_t) fps

    Each is exact for polynomial motion of its own degree, and is the derivative at the middle of its frames
    up to O(1 / fps^2).

    positions   (T, ..., 3), metres, T > order; a window of order + 1 frames gives the one value of it
    returns     (T - order, ..., 3), m / s^order

    Raises InputError for too few frames, positions that are not finite, or a rate that is not positive.
    """
    if order not in NAMES:
        raise InputError(f"derivatives: order = {order} is not allowed; choose 1, 2 or 3")
    what = NAMES[order]
    if positions.ndim < 3 or len(positions) <= order:
        raise InputError(
            f"{what} needs positions of shape (T >= {order + 1}, V, 3), got {positions.shape}; "
            f"{order + 1} frames or more"
        )
    check_rate(fps, what)
    return np.diff(checked_points(positions, what), n=order, axis=0) * fps**order


def derivative_errors(prediction: np.ndarray, truth: np.ndarray, fps: float, order: int) -> np.ndarray:
    """|d^n x_i - d^n y_i| of corresponding vertices of two sequences at one frame rate; (T - n, V), m / s^n.

    n = `order`, as in `derivatives`. What both sides have in common cancels before it is multiplied by fps^n.
    """
    checked_pair(prediction, truth, NAMES.get(order, "derivatives"))
    difference = np.asarray(prediction, dtype=np.float64) - np.asarray(truth, dtype=np.float64)
    return np.linalg.norm(derivatives(difference, fps, order), axis=-1)


def velocity_errors(prediction: np.ndarray, truth: np.ndarray, fps: float) -> np.ndarray:
    """|v_i - w_i|, v = (x_{t+1} - x_t) fps; of (T >= 2, V, 3), metres; (T - 1, V), m/s.

    A constant offset in space costs nothing here; one that jumps by d from a frame to the next costs d fps.
    """
    return derivative_errors(prediction, truth, fps, 1)


def acceleration_errors(prediction: np.ndarray, truth: np.ndarray, fps: float) -> np.ndarray:
    """|a_i - b_i|, a = (x_{t+2} - 2 x_{t+1} + x_t) fps^2; of (T >= 3, V, 3), metres; (T - 2, V), m/s^2."""
    return derivative_errors(prediction, truth, fps, 2)


def jerk_errors(prediction: np.ndarray, truth: np.ndarray, fps: float) -> np.ndarray:
    """|j_i - k_i|, j = (x_{t+3} - 3 x_{t+2} + 3 x_{t+1} - x_t) fps^3; of (T >= 4, V, 3); (T - 3, V), m/s^3"""
    return derivative_errors(prediction, truth, fps, 3)


def jerk_sizes(positions: np.ndarray, fps: float) -> np.ndarray:
    """|j_t| of each vertex; of (T >= 4, V, 3), metres, or a window of 4 frames; (T - 3, V), m/s^3.

    Positions in float32 tremble by themselves: just below one metre by 1.7e-8 m, which is 0.003 m/s^3 at 30
    frames per second.
    """
    return np.linalg.norm(derivatives(positions, fps, 3), axis=-1)


def jitter(
    prediction: np.ndarray, truth: np.ndarray, fps: float, weights: np.ndarray | None = None
) -> Jitter:
    """Mean |jerk| of both sequences and their ratio.

        J = 1 / (T - 3) sum_t ( sum_i w_i |j_t,i| / sum_i w_i )

    White noise of standard deviation s in every coordinate has J = s fps^3 sqrt(20) sqrt(8 / pi), so jitter
    of one height counts for eight times as much at twice the rate: compare at one rate only.

    prediction, truth   (T >= 4, V, 3), metres; the vertices of one need not be those of the other
    weights             (V,), such as the truth's `vertex_areas`; None counts every vertex alike, and is what
                        two meshes of different vertices need

    Source: Yi, Zhou, Xu 2021 (TransPose), "jitter": the mean jerk of all joints in space; jerk as the measure
    of smoothness: Flash, Hogan 1985.
    """
    sizes = [jerk_sizes(side, fps) for side in (prediction, truth)]
    if len(sizes[0]) != len(sizes[1]):
        raise InputError(
            f"jitter: {len(prediction)} frames of the prediction, {len(truth)} of the truth; give as many"
        )
    if weights is not None and any(side.shape[1:] != weights.shape for side in sizes):
        raise InputError(
            f"jitter: {weights.shape} weights for {sizes[0].shape[1:]} and {sizes[1].shape[1:]} vertices; "
            "one a vertex, or None"
        )
    return jitter_of_means(*(float(np.average(side, axis=1, weights=weights).mean()) for side in sizes))


def jitter_of_means(prediction: float, truth: float) -> Jitter:
    """`Jitter` of mean jerks that were gathered window by window, m/s^3."""
    return Jitter(prediction, truth, prediction / truth if truth > 0.0 else None)
