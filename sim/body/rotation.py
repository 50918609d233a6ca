"""Rotation vectors and rotation matrices."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def rotation_matrices(rotation_vectors: ArrayLike) -> NDArray[np.float64]:
    """Rotation matrices of rotation vectors (axis times angle).

    R = I + sinc(a) [r]x + (1/2) sinc^2(a/2) [r]x^2,   a = |r|,  sinc(x) = sin(x) / x

    Rodrigues' formula, written so that it is smooth and exact at r = 0.

    Args:
        rotation_vectors: (..., 3), radians.

    Returns:
        (..., 3, 3)
    """
    r = np.asarray(rotation_vectors, dtype=np.float64)
    angle = np.linalg.norm(r, axis=-1)[..., None, None]
    cross = np.zeros((*r.shape[:-1], 3, 3))
    cross[..., 0, 1], cross[..., 0, 2], cross[..., 1, 2] = -r[..., 2], r[..., 1], -r[..., 0]
    cross[..., 1, 0], cross[..., 2, 0], cross[..., 2, 1] = r[..., 2], -r[..., 1], r[..., 0]
    # numpy's sinc is sin(pi x) / (pi x)
    first = np.sinc(angle / np.pi)
    second = 0.5 * np.sinc(0.5 * angle / np.pi) ** 2
    return np.eye(3) + first * cross + second * (cross @ cross)
