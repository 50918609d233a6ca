"""Feet that stay where they stand: contacts found, pinned, and kept on the floor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_closing, binary_opening, gaussian_filter1d

from muslin.sim.body.model import BodyModel
from muslin.sim.motion.grounding import FLOOR_QUANTILE, lift_above_floor, lowest_heights
from muslin.sim.motion.motion import Motion
from muslin.sim.motion.retarget.legs import reach
from muslin.sim.motion.skeleton import JOINT, forward_kinematics

Array = NDArray[np.float64]

CONTACT_HEIGHT = 0.05
"""Metres: a sole lower than this, and slower than CONTACT_SPEED, stands."""
CONTACT_SPEED = 0.6
"""Metres per second, of the ball of the foot."""
_SHORTEST = 0.08  # seconds: briefer contacts, and gaps in contacts, are noise
_FADE = 0.15  # seconds in which a correction comes and goes


def clean_feet(motion: Motion, body: BodyModel) -> Motion:
    """Floor at the soles, feet pinned while they stand, nothing below the floor."""
    motion = _shifted(motion, -float(np.quantile(lowest_heights(motion, body), FLOOR_QUANTILE)))
    poses = motion.poses.copy()
    for side in ("left", "right"):
        poses = _pinned(motion, poses, body, side)
    motion = motion.with_frames(poses, motion.translations)
    lift = lift_above_floor(lowest_heights(motion, body), motion.fps)
    return _shifted(motion, lift)


def standing(motion: Motion, body: BodyModel, side: str) -> NDArray[np.bool_]:
    """(T,) whether the foot of `side` stands on the floor."""
    ball = forward_kinematics(motion.poses, body.joint_template, motion.translations)[
        :, JOINT[f"{side}_foot"]
    ]
    velocity = np.gradient(gaussian_filter1d(ball, 0.02 * motion.fps, axis=0, mode="nearest"), axis=0)
    slow = np.linalg.norm(velocity, axis=1) * motion.fps < CONTACT_SPEED
    low = lowest_heights(motion, body, vertices=_sole(body, side)) < CONTACT_HEIGHT
    window = np.ones(max(round(_SHORTEST * motion.fps), 2), dtype=bool)
    padded = np.pad(low & slow, len(window), mode="edge")
    return binary_opening(binary_closing(padded, window), window)[len(window) : -len(window)]


def _pinned(motion: Motion, poses: Array, body: BodyModel, side: str) -> Array:
    joints = forward_kinematics(motion.poses, body.joint_template, motion.translations)
    ball = joints[:, JOINT[f"{side}_foot"]]
    low = lowest_heights(motion, body, vertices=_sole(body, side))
    stands = standing(motion, body, side)
    frames = np.arange(motion.num_frames)
    known = {}
    for run in np.split(frames[stands], np.flatnonzero(np.diff(frames[stands]) > 1) + 1):
        pin = np.median(ball[run], axis=0) if len(run) else np.zeros(3)
        for frame in run:
            known[int(frame)] = np.array([pin[0] - ball[frame, 0], -low[frame], pin[2] - ball[frame, 2]])
    # Away from every contact the foot moves as captured.
    fade = max(round(_FADE * motion.fps), 1)
    near = np.convolve(stands, np.ones(2 * fade + 1), mode="same") > 0
    known.update({int(frame): np.zeros(3) for frame in frames[~near]})
    if not known:
        return poses
    at = np.array(sorted(known))
    values = np.array([known[int(frame)] for frame in at])
    offsets = np.stack([np.interp(frames, at, values[:, axis]) for axis in range(3)], axis=1)
    offsets = gaussian_filter1d(offsets, 0.025 * motion.fps, axis=0, mode="nearest")
    offsets[:, 1] = np.maximum(offsets[:, 1], -low)
    ankle = joints[:, JOINT[f"{side}_ankle"]] + offsets
    return reach(poses, motion.translations, body.joint_template, side, ankle)


def _sole(body: BodyModel, side: str) -> NDArray[np.intp]:
    part = np.argmax(body.weights, axis=1)
    return np.flatnonzero((part == JOINT[f"{side}_ankle"]) | (part == JOINT[f"{side}_foot"]))


def _shifted(motion: Motion, lift: Array | float) -> Motion:
    return motion.with_frames(
        motion.poses, motion.translations + np.multiply.outer(lift, np.array([0.0, 1.0, 0.0]))
    )
