"""SMPL's 24 joints: names, parents, left-right pairs, forward kinematics."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from muslin.sim.motion.rotations import multiply, quaternion_from_axis_angle, rotate

Array = NDArray[np.float64]

JOINT_NAMES: tuple[str, ...] = (
    "pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2", "left_ankle",
    "right_ankle", "spine3", "left_foot", "right_foot", "neck", "left_collar", "right_collar", "head",
    "left_shoulder", "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist",
    "left_hand", "right_hand",
)  # fmt: skip
JOINT: dict[str, int] = {name: index for index, name in enumerate(JOINT_NAMES)}

PARENTS: tuple[int, ...] = (
    -1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21,
)  # fmt: skip

MIRRORED: tuple[int, ...] = tuple(
    JOINT[name.replace("left", "\0").replace("right", "left").replace("\0", "right")] for name in JOINT_NAMES
)
"""Joint that takes each joint's part in a mirror: left and right change places."""


def global_rotations(poses: ArrayLike) -> Array:
    """World rotation of each joint: G_j = G_parent(j) R_j. poses (..., 24, 3) axis-angle -> (..., 24, 4)."""
    local = quaternion_from_axis_angle(poses)
    world = np.empty_like(local)
    world[..., 0, :] = local[..., 0, :]
    for joint in range(1, len(PARENTS)):
        world[..., joint, :] = multiply(world[..., PARENTS[joint], :], local[..., joint, :])
    return world


def forward_kinematics(poses: ArrayLike, rest_joints: ArrayLike, translations: ArrayLike = 0.0) -> Array:
    """World joint positions x_j = x_parent + G_parent (r_j - r_parent), x_0 = r_0 + t; SMPL's convention.

    poses (..., 24, 3) radians; rest_joints r (24, 3) metres; translations t (..., 3) metres -> (..., 24, 3).
    """
    rest = np.asarray(rest_joints, dtype=np.float64)
    world = global_rotations(poses)
    positions = np.empty((*world.shape[:-1], 3))
    positions[..., 0, :] = rest[0] + np.asarray(translations, dtype=np.float64)
    for joint in range(1, len(PARENTS)):
        parent = PARENTS[joint]
        bone = rotate(world[..., parent, :], rest[joint] - rest[parent])
        positions[..., joint, :] = positions[..., parent, :] + bone
    return positions
