"""Play a motion faster and slower in turns."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import BSpline

from muslin.garments.errors import InputError
from muslin.sim.motion.motion import Motion


def time_warp(motion: Motion, strength: float, seed: int, period: float = 1.0) -> Motion:
    """The same poses in the same order at a smoothly varying speed, from first frame to last.

    Speed of play is s(t) = (1 + strength)^u(t), with u in [-1, 1] a cubic B-spline through uniform random
    coefficients `period` seconds apart; so 1/(1 + strength) <= s <= 1 + strength, and the time read at
    output frame k is the sum of s / fps before it.
    """
    if not (0.0 <= strength <= 1.0 and period > 0.0):
        raise InputError(f"time_warp: strength {strength}, period {period}; allowed 0 to 1, and above 0 s")
    rng = np.random.default_rng(seed)
    longest = motion.duration * (1.0 + strength)
    count = int(np.ceil(longest / period)) + 4
    knots = np.arange(-3, count + 1) * period
    spline = BSpline(knots, rng.uniform(-1.0, 1.0, size=count), 3)
    output = np.arange(int(np.ceil(longest * motion.fps)) + 1) / motion.fps
    speed = (1.0 + strength) ** spline(output)
    read = np.concatenate([[0.0], np.cumsum(speed[:-1]) / motion.fps])
    poses, translations = motion.at(read[read <= motion.duration + 1e-9])
    did = f"time-warped by {strength:g} (seed {seed}, period {period:g} s)"
    return motion.with_frames(poses, translations, did=did)
