"""What lies inside a closed body, by generalized winding numbers."""

from __future__ import annotations

import igl
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from muslin.garments.errors import InputError

INSIDE = 0.5
# The fast winding number is an expansion: values this close to the threshold are computed exactly instead.
UNSURE = 0.1

MASK_GAP_M = 4e-3
"""Metres. A face may be left out of contact where it lies inside the body or within this distance of another
part of it, since two layers of cloth with contact gaps do not fit there."""

GAP_SHARES = (1.0, 0.1)
"""Of the gap: how far in front of a face the body is looked for; close by, for faces in thin parts."""

CREASE_M = 0.01
"""Metres. So near to vertices that lie inside it the body may give way to squeezed cloth."""


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
    """Whether each face has the body within `gap` metres in front of it, or is at a crease of the body.

    Such a face may be left out of contact: cloth has no room there. A face passes if at least one of four
    points, its corners and its centroid, moved by `gap` or by a tenth of it along its outward normal, lies
    inside the closed body, or if a corner is within `CREASE_M` of a vertex that does. The test knows nothing
    of how the faces were chosen.

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
    points = np.concatenate([corners, corners.mean(axis=1, keepdims=True)], axis=1)
    samples = np.concatenate([points + share * gap * normals[:, None] for share in GAP_SHARES], axis=1)
    passed = np.any(interior_points(v, f, samples.reshape(-1, 3)).reshape(samples.shape[:2]), axis=1)
    passed[~passed] = _at_a_crease(v, f, f[chosen[~passed]], GAP_SHARES[-1] * gap)
    return passed


def _at_a_crease(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], chosen: NDArray[np.int64], offset: float
) -> NDArray[np.bool_]:
    """Whether a corner of each of the `chosen` (K, 3) is within `CREASE_M` of a vertex inside the body.

    Vertices are looked at `offset` metres above the surface, on which they lie.
    """
    if len(chosen) == 0:
        return np.zeros(0, dtype=bool)
    corners, place = np.unique(chosen, return_inverse=True)
    around = cKDTree(vertices).query_ball_point(vertices[corners], CREASE_M)
    asked = np.unique(np.concatenate([np.asarray(a, dtype=np.int64) for a in around]))
    normals = igl.per_vertex_normals(vertices, np.ascontiguousarray(faces, dtype=np.int64))
    inside = np.zeros(len(vertices), dtype=bool)
    inside[asked] = interior_points(vertices, faces, vertices[asked] + offset * normals[asked])
    near = np.array([inside[a].any() for a in around])
    return np.asarray(near[place.reshape(chosen.shape)].any(axis=1))
