"""The shape space: principal components of T-pose bodies, and joints as functions of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from muslin.sim.body.joints import PARENTS

Floats = NDArray[np.float64]

NUM_BETAS = 10
CANDIDATES_PER_OCTANT = 20
REGRESSOR_BODIES = 200


@dataclass(frozen=True)
class ShapeSpace:
    """v(beta) = v_template + shapedirs beta, J(beta) = joint_template + joint_shapedirs beta."""

    v_template: Floats
    shapedirs: Floats
    joint_template: Floats
    joint_shapedirs: Floats
    explained: Floats
    vertex_error: float
    joint_error: float


def fit_shape_space(vertices: NDArray[np.floating], joints: Floats, faces: NDArray[np.int32]) -> ShapeSpace:
    """Principal components scaled to one standard deviation each.

    Every component is signed so that the volume of the body grows with its beta.

    Args:
        vertices: (N, V, 3) T-pose, pelvis at the origin; joints: (N, 24, 3); faces: (F, 3).
    """
    count = len(vertices)
    rows = vertices.reshape(count, -1).astype(np.float64)
    mean = rows.mean(axis=0)
    rows -= mean
    variances, vectors = np.linalg.eigh(rows @ rows.T / (count - 1))
    variances, vectors = variances[::-1], vectors[:, ::-1]
    scores = vectors[:, :NUM_BETAS] * np.sqrt(count - 1)
    directions = rows.T @ scores / (count - 1)
    template = mean.reshape(-1, 3)
    for k in range(NUM_BETAS):
        step = directions[:, k].reshape(-1, 3)
        if volume(template + step, faces) < volume(template - step, faces):
            directions[:, k] *= -1.0
            scores[:, k] *= -1.0
    shapedirs = directions.reshape(-1, 3, NUM_BETAS)
    design = np.column_stack([np.ones(count), scores])
    affine, *_ = np.linalg.lstsq(design, joints.reshape(count, -1), rcond=None)
    errors = np.linalg.norm((rows - scores @ directions.T).reshape(count, -1, 3), axis=-1)
    joint_errors = np.linalg.norm(
        (joints.reshape(count, -1) - design @ affine).reshape(count, -1, 3), axis=-1
    )
    return ShapeSpace(
        v_template=template,
        shapedirs=shapedirs,
        joint_template=affine[0].reshape(-1, 3),
        joint_shapedirs=affine[1:].reshape(NUM_BETAS, -1, 3).transpose(1, 2, 0),
        explained=variances[:NUM_BETAS] / variances.sum(),
        vertex_error=float(errors.mean()),
        joint_error=float(joint_errors.mean(axis=0).max()),
    )


def fit_joint_regressor(vertices: NDArray[np.floating], joints: Floats, weights: Floats) -> Floats:
    """A sparse non-negative regressor (24, V), rows sum to one, J = regressor @ v, as in SMPL's files.

    Each joint is fitted to vertices all around it, near ones moved by it or by its parent. It serves programs
    that know only SMPL's form; the affine joints are the accurate ones.
    """
    regressor = np.zeros((joints.shape[1], vertices.shape[1]))
    mean = vertices.mean(axis=0)
    stride = max(1, len(vertices) // REGRESSOR_BODIES)
    bodies, targets = vertices[::stride].astype(np.float64), joints[::stride]
    for joint in range(joints.shape[1]):
        near = _candidates(mean - joints[:, joint].mean(axis=0), weights[:, [joint, max(PARENTS[joint], 0)]])
        system = bodies[:, near].transpose(0, 2, 1).reshape(-1, len(near))
        # a heavy last row asks for weights that sum to one
        system = np.vstack([system, np.full(len(near), 1e3)])
        solution, _ = nnls(system, np.append(targets[:, joint].ravel(), 1e3), maxiter=100 * len(near))
        regressor[joint, near] = solution / solution.sum()
    return regressor


def _candidates(offsets: Floats, weights: Floats) -> NDArray[np.int64]:
    """The vertices nearest to the origin of `offsets` (V, 3) in each octant, of those with any weight."""
    distance = np.where(weights.max(axis=1) > 1e-3, np.linalg.norm(offsets, axis=1), np.inf)
    octants = (offsets > 0.0) @ np.array([1, 2, 4])
    chosen = []
    for octant in range(8):
        members = np.flatnonzero((octants == octant) & np.isfinite(distance))
        chosen.append(members[np.argsort(distance[members])[:CANDIDATES_PER_OCTANT]])
    return np.concatenate(chosen)


def volume(vertices: Floats, faces: NDArray[np.int32]) -> float:
    """Volume inside a closed surface, cubic metres: sum of v0 . (v1 x v2) / 6."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.einsum("fi,fi->", a, np.cross(b, c)) / 6.0)
