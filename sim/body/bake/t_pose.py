"""Brings anny's A-pose to SMPL's T-pose by the exact inverse of linear blend skinning."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from muslin.sim.body.joints import JOINT, NUM_JOINTS, PARENTS

Floats = NDArray[np.float64]

# Each arm joint and the joint that its segment points to.
_ARM = {"shoulder": "elbow", "elbow": "wrist", "wrist": "hand"}


def to_t_pose(vertices: NDArray[np.floating], joints: Floats, weights: Floats) -> tuple[Floats, Floats]:
    """Straightens the arms along +-x and puts the pelvis at the origin.

    The T-pose v_T is the one from which skinning gives the A-pose back exactly:

        v_A = sum_j w_j H_j v_T,   H_j x = A_j^T (x - t_j) + a_j

    with a_j, t_j the joints in A- and T-pose and A_j the rotation of segment j from A- to T-pose.

    Args:
        vertices: (V, 3), joints: (24, 3), of one body in A-pose; weights: (V, 24).

    Returns:
        T-pose vertices (V, 3) and joints (24, 3).
    """
    rotations = _segment_rotations(joints)
    posed = np.zeros((NUM_JOINTS, 3))
    for joint in range(1, NUM_JOINTS):
        parent = PARENTS[joint]
        posed[joint] = posed[parent] + rotations[parent] @ (joints[joint] - joints[parent])
    back = rotations.transpose(0, 2, 1)
    linear = np.einsum("vj,jab->vab", weights, back)
    offset = weights @ (joints - np.einsum("jab,jb->ja", back, posed))
    return np.linalg.solve(linear, (vertices - offset)[..., None])[..., 0], posed


def _segment_rotations(joints: Floats) -> Floats:
    """Rotation of each joint's segment from A- to T-pose, (24, 3, 3): minimal turns down the arm."""
    rotations = np.tile(np.eye(3), (NUM_JOINTS, 1, 1))
    for side, sign in (("left", 1.0), ("right", -1.0)):
        turn = np.eye(3)
        for start, end in _ARM.items():
            segment = turn @ (joints[JOINT[f"{side}_{end}"]] - joints[JOINT[f"{side}_{start}"]])
            turn = minimal_rotation(segment, np.array([sign, 0.0, 0.0])) @ turn
            rotations[JOINT[f"{side}_{start}"]] = turn
        rotations[JOINT[f"{side}_hand"]] = turn
    return rotations


def minimal_rotation(source: Floats, target: Floats) -> Floats:
    """The smallest rotation that turns the direction of `source` into that of `target`, (3, 3)."""
    a, b = source / np.linalg.norm(source), target / np.linalg.norm(target)
    axis, cosine = np.cross(a, b), float(a @ b)
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + cross + cross @ cross / (1.0 + cosine)
