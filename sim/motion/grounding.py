"""Put a motion onto a body: its own rest pelvis, and the floor under its posed surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from muslin.sim.body.model import BodyModel
from muslin.sim.motion.motion import Motion

Array = NDArray[np.float64]

FLOOR_QUANTILE = 0.2
"""A body stands on the floor in most frames and leaves it in some: the floor is this quantile of its lows."""

_BLOCK = 64


def lowest_heights(
    motion: Motion, body: BodyModel, beta: ArrayLike | None = None, vertices: NDArray[np.intp] | None = None
) -> Array:
    """(T,) height of the lowest vertex of the posed body, or of those listed, in each frame, metres."""
    lows = np.empty(motion.num_frames)
    for start in range(0, motion.num_frames, _BLOCK):
        block = slice(start, start + _BLOCK)
        heights = body.vertices(beta, motion.poses[block], motion.translations[block])[..., 1]
        lows[block] = (heights if vertices is None else heights[:, vertices]).min(axis=1)
    return lows


def fit_to_body(motion: Motion, body: BodyModel, beta: ArrayLike | None = None) -> Motion:
    """`motion` for another body: translations about its rest pelvis, floor under its own feet.

    A clip is grounded for the body it was made for; a body of other leg length would float or sink. The
    whole clip is moved vertically so that the floor quantile of its lowest vertices is at y = 0, and what
    still sinks below is lifted. Horizontal places are kept: strides are the clip's, not the body's.
    """
    rest = body.rest_joints(beta)[0]
    moved = Motion(motion.name, motion.poses, motion.pelvis - rest, motion.fps, motion.source, rest)
    lows = lowest_heights(moved, body, beta)
    floor = float(np.quantile(lows, FLOOR_QUANTILE))
    lift = lift_above_floor(lows - floor, motion.fps)
    return moved.with_frames(
        moved.poses,
        moved.translations + np.stack([np.zeros_like(lift), lift - floor, np.zeros_like(lift)], axis=1),
        did=f"grounded for body {body.name}",
    )


def lift_above_floor(lows: Array, fps: float, ramp: float = 0.1) -> Array:
    """(T,) smooth lift >= max(0, -lows), metres.

    The largest need within `ramp` seconds around, averaged twice over windows that together are no wider:
    an average of values that are all at least the need at the middle is at least that need.
    """
    radius = max(round(ramp * fps), 1)
    need = maximum_filter1d(np.maximum(-lows, 0.0), 2 * radius + 1, mode="nearest")
    window = 2 * (radius // 2) + 1
    return uniform_filter1d(uniform_filter1d(need, window, mode="nearest"), window, mode="nearest")
