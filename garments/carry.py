"""Carrying a planar mesh along when its boundary moves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu

from muslin.garments.mesh import signed_areas

STEPS = 8


def carry(
    points: NDArray[np.float64], faces: NDArray[np.int32], boundary: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Points (N, 2) of the mesh after its first B points moved to `boundary` (B, 2), metres.

    The boundary moves along straight lines in STEPS equal steps. In each, the interior follows by the
    displacement u that is harmonic on the mesh as it then lies, with stiffness k_f a triangle:

        sum_f k_f grad(u)|_f . grad(phi_i)|_f area_f = 0   at every interior vertex i,
        k_f = q_f / sqrt(a_f),   q_f = (l_1^2 + l_2^2 + l_3^2) / (4 sqrt(3) area_f) >= 1,

    l the lengths of its sides, a_f its area over its area at the start, over the median of that ratio. One
    step with k_f = 1 is the harmonic map; it folds at concave boundaries (a deep neckline), while small steps
    that stiffen what is already squeezed or flattened do not. A boundary that does not move moves nothing.
    """
    fixed = len(boundary)
    start = signed_areas(points, faces)
    carried = points.copy()
    for step in range(STEPS):
        area = signed_areas(carried, faces)
        sides = sum(((carried[faces[:, k]] - carried[faces[:, k - 1]]) ** 2).sum(axis=1) for k in range(3))
        quality = sides / (4.0 * np.sqrt(3.0) * area)
        ratio = area / start
        stiffness = quality / np.sqrt(ratio / np.median(ratio))
        move = (boundary - carried[:fixed]) / (STEPS - step)
        carried[fixed:] += _harmonic(carried, faces, stiffness, move)
        carried[:fixed] += move
    carried[:fixed] = boundary
    return carried


def _harmonic(
    points: NDArray[np.float64],
    faces: NDArray[np.int32],
    stiffness: NDArray[np.float64],
    values: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Interior values (N - B, k) of the harmonic function with `values` (B, k) at the first B points.

    Finite elements with the cotangent Laplacian (U. Pinkall and K. Polthier 1993, "Computing discrete minimal
    surfaces and their conjugates").
    """
    rows, columns, entries = [], [], []
    for k in range(3):
        i, j, corner = faces[:, (k + 1) % 3], faces[:, (k + 2) % 3], points[faces[:, k]]
        u, v = points[i] - corner, points[j] - corner
        weight = 0.5 * stiffness * (u * v).sum(axis=1) / (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
        rows += [i, j, i, j]
        columns += [j, i, i, j]
        entries += [-weight, -weight, weight, weight]
    size, fixed = len(points), len(values)
    matrix = coo_matrix(
        (np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns))), shape=(size, size)
    ).tocsr()
    inner = matrix[fixed:, fixed:].tocsc()
    return splu(inner, permc_spec="MMD_AT_PLUS_A").solve(-(matrix[fixed:, :fixed] @ values))
