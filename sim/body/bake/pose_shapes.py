"""Pose blend shapes that make linear blend skinning follow dual-quaternion skinning."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from muslin.sim.body.bake.dual_quaternions import dual_quaternion_skinning
from muslin.sim.body.joints import NUM_JOINTS, NUM_POSE_FEATURES, PARENTS
from muslin.sim.body.model import BodyModel
from muslin.sim.body.rotation import rotation_matrices

Floats = NDArray[np.float64]

# A joint shapes a vertex only if it moves it by at least this weight.
SMALLEST_INFLUENCE = 1e-3


def pose_targets(model: BodyModel, poses: Floats) -> Floats:
    """Rest-pose offsets d with LBS(T + d) = DQS(T), (N, V, 3), for the mean shape of `model`.

    d = M^-1 (DQS(T) - t) - T, where x -> M x + t is a vertex's blended transform.
    """
    offsets = np.empty((len(poses), model.num_vertices, 3))
    for n, transforms in enumerate(model.transforms(None, poses)):
        target = dual_quaternion_skinning(model.v_template, model.weights, transforms)
        blended = (model.weights @ transforms.reshape(NUM_JOINTS, 16)).reshape(-1, 4, 4)
        solved = np.linalg.solve(blended[:, :3, :3], (target - blended[:, :3, 3])[..., None])
        offsets[n] = solved[..., 0] - model.v_template
    return offsets


def fit_pose_shapes(poses: Floats, offsets: Floats, weights: Floats, ridge: float) -> Floats:
    """Local ridge regression of the offsets on vec(R - I), (V, 3, 207).

    Both skinnings follow a common rotation of all the joints that move a vertex, so its offset depends only
    on the rotations between those joints: of the joints on the paths between them, without the topmost.
    Everything else stays zero, which keeps the shapes local, free of chance correlations, and small.

    Args:
        poses: (N, 24, 3); offsets: (N, V, 3); weights: (V, 24)
        ridge: added to the diagonal of the mean squared features.
    """
    features = pose_features(poses)
    shapes = np.zeros((offsets.shape[1], 3, NUM_POSE_FEATURES))
    active = _joints_between(weights)
    patterns, members = np.unique(active, axis=0, return_inverse=True)
    for index, pattern in enumerate(patterns):
        columns = np.flatnonzero(np.repeat(pattern[1:], 9))
        if len(columns) == 0:
            continue
        rows = np.flatnonzero(members == index)
        x = features[:, columns]
        y = offsets[:, rows].reshape(len(poses), -1)
        gram = x.T @ x / len(x) + ridge * np.eye(len(columns))
        solution = np.linalg.solve(gram, x.T @ y / len(x))
        shapes[np.ix_(rows, np.arange(3), columns)] = solution.T.reshape(len(rows), 3, len(columns))
    return shapes


def pose_features(poses: Floats) -> Floats:
    """vec(R(theta) - I) of the joints below the root, (N, 207)."""
    return (rotation_matrices(poses[:, 1:]) - np.eye(3)).reshape(len(poses), -1)


def explained_share(poses: Floats, offsets: Floats, shapes: Floats) -> float:
    """R^2 = 1 - sum |d - P x|^2 / sum |d|^2 over poses and vertices."""
    predicted = (pose_features(poses) @ shapes.reshape(-1, NUM_POSE_FEATURES).T).reshape(offsets.shape)
    return float(1.0 - np.sum((offsets - predicted) ** 2) / np.sum(offsets**2))


def _joints_between(weights: Floats) -> NDArray[np.bool_]:
    moved = weights > SMALLEST_INFLUENCE
    ancestors = np.zeros((NUM_JOINTS, NUM_JOINTS), dtype=bool)
    for joint in range(NUM_JOINTS):
        node = joint
        while node >= 0:
            ancestors[joint, node] = True
            node = PARENTS[node]
    # ancestors (with themselves) of any moving joint, without those that all moving joints have in common
    any_of = moved.astype(np.int64) @ ancestors.astype(np.int64)
    return (any_of > 0) & (any_of < moved.sum(axis=1, keepdims=True))
