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

_LONGEST = 0.9995  # of the stretched leg: the knee keeps a bend, and with it a direction to bend in
_SOFT_FROM = 0.98  # of the stretched leg: from here a target is approached ever more slowly
_HINGE = 0.3  # sine of the knee angle at which the thigh's axis counts as much as the leg's own plane


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
    length = _softened(np.linalg.norm(wanted, axis=1), upper + lower)
    length = np.maximum(length, np.abs(upper - lower) * 1.01)

    # A bent leg bends on in its own plane; the straighter it is, the more about the thigh's sideways axis, so
    # that a captured knee that is straight, or bent backwards by an error, bends forwards.
    axis = np.cross(thigh, shin) / (upper * lower)[:, None]
    axis += _HINGE * rotate(world[:, hip_j], np.array([1.0, 0.0, 0.0]))
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


def _softened(length: Array, stretched: Array) -> Array:
    """`length`, bent towards `stretched` with slope 1 at first and none at last.

    Near the stretched leg the knee angle goes as the square root of what is missing: a hard limit would make
    the knee snap as the target comes back into reach.
    """
    start, room = _SOFT_FROM * stretched, (_LONGEST - _SOFT_FROM) * stretched
    over = np.maximum(length - start, 0.0)
    return np.where(over > 0.0, start + room * (1.0 - np.exp(-over / room)), length)
