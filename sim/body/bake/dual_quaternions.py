"""Dual-quaternion skinning: the target of the pose blend shapes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]


def dual_quaternion_skinning(points: Floats, weights: Floats, transforms: Floats) -> Floats:
    """Skinning by normalised blends of unit dual quaternions, which keep volume at bends and twists.

        b = sum_j s_j w_j q_j,   d = sum_j s_j w_j q'_j,   q'_j = (0, t_j) q_j / 2
        v = R(b / |b|) p + 2 vec(d b*) / |b|^2

    with s_j = +-1 that puts q_j into the half-sphere of the heaviest joint's quaternion (antipodality).

    Args:
        points: (V, 3); weights: (V, 24); transforms: (24, 4, 4) rigid.

    Returns:
        (V, 3)

    Source: Kavan, Collins, Zara, O'Sullivan (2008), "Geometric skinning with approximate dual quaternion
    blending", ACM TOG 27(4), section 4.
    """
    real = Rotation.from_matrix(transforms[:, :3, :3]).as_quat(scalar_first=True)
    translation = np.concatenate([np.zeros((len(real), 1)), transforms[:, :3, 3]], axis=1)
    dual = 0.5 * quaternion_product(translation, real)
    signs = np.sign(real @ real.T)[np.argmax(weights, axis=1)]
    signed = weights * np.where(signs == 0.0, 1.0, signs)
    blend, blend_dual = signed @ real, signed @ dual
    norm = np.linalg.norm(blend, axis=1, keepdims=True)
    blend, blend_dual = blend / norm, blend_dual / norm
    conjugate = blend * np.array([1.0, -1.0, -1.0, -1.0])
    shift = 2.0 * quaternion_product(blend_dual, conjugate)[:, 1:]
    return Rotation.from_quat(blend, scalar_first=True).apply(points) + shift


def quaternion_product(p: Floats, q: Floats) -> Floats:
    """Hamilton product of quaternions (..., 4), scalar first."""
    scalar = p[..., :1] * q[..., :1] - np.sum(p[..., 1:] * q[..., 1:], axis=-1, keepdims=True)
    vector = p[..., :1] * q[..., 1:] + q[..., :1] * p[..., 1:] + np.cross(p[..., 1:], q[..., 1:])
    return np.concatenate([scalar, vector], axis=-1)
