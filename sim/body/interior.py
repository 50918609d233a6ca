"""What lies inside a closed body, by generalized winding numbers."""

from __future__ import annotations

import igl
import numpy as np
from numpy.typing import ArrayLike, NDArray

from muslin.garments.errors import InputError

INSIDE = 0.5
# The fast winding number is an expansion: values this close to the threshold are computed exactly instead.
UNSURE = 0.1

MASK_GAP_M = 4e-3
"""Metres. A face may be left out of contact where it lies inside the body or within this distance of another
part of it, since two layers of cloth with contact gaps do not fit there."""


def interior_points(vertices: ArrayLike, faces: ArrayLike, points: ArrayLike) -> NDArray[np.bool_]:
    """Whether each point lies inside a closed surface, which may intersect itself.

        w(p) = (1 / 4 pi) sum_f Omega_f(p) > 1/2,   Omega_f the signed solid angle of face f

    Inside both of two overlapping parts of the surface w is 2, so the test holds there too.

    Args:
        vertices: (V, 3); faces: (F, 3), counter-clockwise seen from outside; points: (P, 3), metres.

    Returns:
        (P,) bool

    Source: Jacobson, Kavan, Sorkine-Hornung (2013), "Robust inside-outside segmentation using generalized
    winding numbers"; Barill et al. (2018), "Fast winding numbers for soups and clouds".
    """
    v = np.ascontiguousarray(vertices, dtype=np.float64)
    f = np.ascontiguousarray(faces, dtype=np.int64)
    p = np.ascontiguousarray(points, dtype=np.float64)
    if not (np.isfinite(v).all() and np.isfinite(p).all()):
        raise InputError("a body vertex or a query point holds NaN or infinity; give finite metres")
    if len(p) == 0:
        return np.zeros(0, dtype=bool)
    winding = igl.fast_winding_number(v, f, p)
    unsure = np.flatnonzero(np.abs(winding - INSIDE) < UNSURE)
    if len(unsure):
        winding[unsure] = igl.winding_number(v, f, np.ascontiguousarray(p[unsure]))
    return np.asarray(winding > INSIDE)


def masked_face_is_interior(
    vertices: ArrayLike, faces: ArrayLike, face_indices: ArrayLike, gap: float
) -> NDArray[np.bool_]:
    """Whether each face has the body itself within `gap` metres in front of it.

    Such a face may be left out of contact: cloth has no room there. A face passes if at least one of four
    points, its corners and its centroid moved by `gap` along its outward normal, lies inside the closed body.
    The test knows nothing of how the faces were chosen.

    Args:
        vertices: (V, 3), metres; faces: (F, 3); face_indices: (K,) into faces; gap: positive, metres.

    Returns:
        (K,) bool

    Raises:
        InputError: gap not positive, or a face index that names no face.
    """
    v, f = np.asarray(vertices, dtype=np.float64), np.asarray(faces)
    chosen = np.asarray(face_indices, dtype=np.int64)
    if not (np.isfinite(gap) and gap > 0.0):
        raise InputError(f"gap is {gap}; allowed are positive metres")
    if len(chosen) and (chosen.min() < 0 or chosen.max() >= len(f)):
        raise InputError(
            f"masked faces reach from {chosen.min()} to {chosen.max()}; the body has {len(f)} faces"
        )
    corners = v[f[chosen]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    # a face of no area has no normal; its own points then decide
    normals = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0.0)
    samples = np.concatenate([corners, corners.mean(axis=1, keepdims=True)], axis=1) + gap * normals[:, None]
    return np.any(interior_points(v, f, samples.reshape(-1, 3)).reshape(-1, 4), axis=1)
