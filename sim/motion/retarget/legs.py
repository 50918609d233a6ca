"""Two-bone inverse kinematics of the legs."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from muslin.sim.motion.rotations import (
    axis_angle_from_quaternion,
    between,
    conjugate,
    multiply,
    rotate,
)
from muslin.sim.motion.skeleton import JOINT, forward_kinematics, global_rotations

Array = NDArray[np.float64]

_LONGEST = 0.999  # of the stretched leg: the knee keeps a bend, and with it a direction to bend in


def reach(poses: Array, translations: Array, rest_joints: ArrayLike, side: str, ankle: Array) -> Array:
    """Poses (T, 24, 3) whose `side` ankle is at `ankle` (T, 3), foot turned in the world as before.

    The knee angle follows from the law of cosines and bends about the axis it is bent about; then the hip
    turns by the smallest rotation that brings the ankle into place. An ankle out of reach is approached.
    """
    hip_j, knee_j, ankle_j = (JOINT[f"{side}_{name}"] for name in ("hip", "knee", "ankle"))
    world = global_rotations(poses)
    joints = forward_kinematics(poses, rest_joints, translations)
    hip, knee, old = joints[:, hip_j], joints[:, knee_j], joints[:, ankle_j]
    thigh, shin = knee - hip, old - knee
    upper, lower = np.linalg.norm(thigh, axis=1), np.linalg.norm(shin, axis=1)
    wanted = ankle - hip
    length = np.clip(np.linalg.norm(wanted, axis=1), np.abs(upper - lower) * 1.01, (upper + lower) * _LONGEST)

    axis = np.cross(thigh, shin)
    sideways = rotate(world[:, 0], np.array([1.0, 0.0, 0.0]))
    # A straight leg bends about the body's own sideways axis, knee forward.
    axis += 1e-3 * (upper * lower)[:, None] * sideways
    down = thigh / upper[:, None]
    back = np.cross(axis, down)
    back /= np.linalg.norm(back, axis=1, keepdims=True)
    cosine = ((length**2 - upper**2 - lower**2) / (2 * upper * lower))[:, None]
    new_shin = lower[:, None] * (cosine * down + np.sqrt(1.0 - cosine**2) * back)
    bend = between(shin, new_shin)
    swing = between(thigh + new_shin, wanted)

    new_hip = multiply(swing, world[:, hip_j])
    new_knee = multiply(swing, multiply(bend, world[:, knee_j]))
    result = poses.copy()
    result[:, hip_j] = axis_angle_from_quaternion(multiply(conjugate(world[:, 0]), new_hip))
    result[:, knee_j] = axis_angle_from_quaternion(multiply(conjugate(new_hip), new_knee))
    result[:, ankle_j] = axis_angle_from_quaternion(multiply(conjugate(new_knee), world[:, ankle_j]))
    return result
