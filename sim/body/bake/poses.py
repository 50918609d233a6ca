"""Plausible poses: independent rotations inside the limits of each joint."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from muslin.sim.body.joints import JOINT, NUM_JOINTS

# Degrees about x, y, z of the T-pose's axes for the left side: (low, high, mean, standard deviation). The
# right side is its mirror image (y and z change sign). Limits follow clinical ranges of motion; means and
# deviations are those of everyday movement, in which arms hang and hips and knees flex.
_LIMITS = {
    "hip": ((-120, 25, -20, 30), (-40, 40, 0, 12), (-20, 45, 5, 10)),
    "knee": ((0, 140, 30, 30), (-10, 10, 0, 4), (-5, 5, 0, 2)),
    "ankle": ((-35, 45, 0, 15), (-15, 15, 0, 6), (-20, 20, 0, 7)),
    "foot": ((-45, 30, 0, 12), (-5, 5, 0, 2), (-5, 5, 0, 2)),
    "spine1": ((-15, 35, 5, 10), (-20, 20, 0, 7), (-20, 20, 0, 6)),
    "spine2": ((-15, 30, 3, 8), (-20, 20, 0, 7), (-20, 20, 0, 6)),
    "spine3": ((-15, 30, 3, 8), (-20, 20, 0, 7), (-15, 15, 0, 5)),
    "neck": ((-30, 35, 3, 12), (-35, 35, 0, 14), (-25, 25, 0, 8)),
    "head": ((-25, 30, 0, 10), (-35, 35, 0, 14), (-20, 20, 0, 7)),
    "collar": ((-5, 5, 0, 2), (-20, 15, -2, 7), (-12, 35, 0, 9)),
    "shoulder": ((-70, 70, 0, 25), (-115, 40, -15, 30), (-95, 70, -50, 35)),
    "elbow": ((-70, 70, 0, 25), (-145, 5, -45, 35), (-5, 5, 0, 2)),
    "wrist": ((-30, 30, 0, 10), (-30, 30, 0, 12), (-60, 60, 0, 18)),
    "hand": ((-5, 5, 0, 2), (-10, 10, 0, 3), (-60, 15, -10, 15)),
}

# Share of the poses drawn uniformly over the limits, so that the far ends are seen too.
UNIFORM_SHARE = 0.35


def sample_poses(count: int, seed: int) -> NDArray[np.float64]:
    """Random poses, (count, 24, 3) rotation vectors, radians; the root is not turned."""
    generator = np.random.default_rng(seed)
    poses = np.zeros((count, NUM_JOINTS, 3))
    uniform = generator.random(count) < UNIFORM_SHARE
    for name, limits in _LIMITS.items():
        table = np.radians(np.array(limits, dtype=np.float64))
        low, high, mean, deviation = table.T
        for joint, mirror in _sides(name):
            usual = np.clip(mean + deviation * generator.standard_normal((count, 3)), low, high)
            extreme = generator.uniform(low, high, (count, 3))
            poses[:, joint] = np.where(uniform[:, None], extreme, usual) * mirror
    return poses


def _sides(name: str) -> list[tuple[int, NDArray[np.float64]]]:
    plain = np.ones(3)
    if name in JOINT:
        return [(JOINT[name], plain)]
    return [(JOINT[f"left_{name}"], plain), (JOINT[f"right_{name}"], np.array([1.0, -1.0, -1.0]))]
