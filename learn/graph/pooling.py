"""Q_d and Q_u: from the vertices of a mesh to those of a decimated one, and back."""

from __future__ import annotations

import igl
import numpy as np
import warp as wp
from numpy.typing import NDArray
from scipy.sparse import csr_array

from muslin.learn.graph.decimate import Decimated

wp.set_module_options({"enable_backward": False})


def pool_matrix(coarse: NDArray[np.integer], count: int) -> csr_array:
    """Q_d (W, V): the values of the kept vertices; coarse (W,): these, of V = count."""
    ones = np.ones(len(coarse), dtype=np.float32)
    return csr_array((ones, np.asarray(coarse), np.arange(len(coarse) + 1)), shape=(len(coarse), count))


def unpool_matrix(positions: NDArray[np.floating], decimated: Decimated, level: int) -> csr_array:
    """Q_u (V, W): from level + 1 with W vertices to `level` with V, barycentric:

        (Q_u y)_v = sum_k b_vk y[corner_vk],

    the nearest point to v among those triangles of level + 1 that are at the vertex it went onto, or at a
    neighbour of that one. (The nearest of all triangles may be another layer of cloth: a sleeve at the side
    of the torso.) A vertex that was kept gets its own value, so Q_d Q_u = I; all rows sum to one.

    positions   (V_0, 3) of level 0, metres
    """
    x = np.ascontiguousarray(positions, dtype=np.float64)
    fine, coarse = decimated.kept[level], decimated.kept[level + 1]
    faces = np.ascontiguousarray(decimated.faces[level + 1])
    around, starts = igl.vertex_triangle_adjacency(faces, len(coarse))
    corners = wp.empty(len(fine), dtype=wp.vec3i, device="cpu")
    weights = wp.empty(len(fine), dtype=wp.vec3d, device="cpu")
    wp.launch(
        _nearest,
        dim=len(fine),
        inputs=[
            wp.array(x[fine], dtype=wp.vec3d, device="cpu"),
            wp.array(x[coarse], dtype=wp.vec3d, device="cpu"),
            wp.array(faces, dtype=wp.vec3i, device="cpu"),
            wp.array(np.asarray(around, np.int32), device="cpu"),
            wp.array(np.asarray(starts, np.int32), device="cpu"),
            wp.array(decimated.onto[level], device="cpu"),
        ],
        outputs=[corners, weights],
        device="cpu",
    )
    columns, values = corners.numpy(), weights.numpy().astype(np.float32)
    kept = np.searchsorted(fine, coarse)
    columns[kept], values[kept] = np.arange(len(coarse))[:, None], [1.0, 0.0, 0.0]
    rows = np.repeat(np.arange(len(fine)), 3)
    matrix = csr_array((values.ravel(), (rows, columns.ravel())), shape=(len(fine), len(coarse)))
    matrix.eliminate_zeros()
    return matrix


@wp.func
def _coordinates(p: wp.vec3d, a: wp.vec3d, b: wp.vec3d, c: wp.vec3d) -> wp.vec3d:
    """Barycentric coordinates of the point of a triangle that is nearest to p.

    Source: Ericson 2005, "Real-time collision detection", section 5.1.5.
    """
    zero = wp.float64(0.0)
    one = wp.float64(1.0)
    ab = b - a
    ac = c - a
    d1 = wp.dot(ab, p - a)
    d2 = wp.dot(ac, p - a)
    if d1 <= zero and d2 <= zero:
        return wp.vec3d(one, zero, zero)
    d3 = wp.dot(ab, p - b)
    d4 = wp.dot(ac, p - b)
    if d3 >= zero and d4 <= d3:
        return wp.vec3d(zero, one, zero)
    d5 = wp.dot(ab, p - c)
    d6 = wp.dot(ac, p - c)
    if d6 >= zero and d5 <= d6:
        return wp.vec3d(zero, zero, one)
    vc = d1 * d4 - d3 * d2
    if vc <= zero and d1 >= zero and d3 <= zero:
        t = d1 / (d1 - d3)
        return wp.vec3d(one - t, t, zero)
    vb = d5 * d2 - d1 * d6
    if vb <= zero and d2 >= zero and d6 <= zero:
        t = d2 / (d2 - d6)
        return wp.vec3d(one - t, zero, t)
    va = d3 * d6 - d5 * d4
    if va <= zero and d4 >= d3 and d5 >= d6:
        t = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return wp.vec3d(zero, one - t, t)
    return wp.vec3d(va, vb, vc) / (va + vb + vc)


@wp.kernel
def _nearest(
    fine: wp.array(dtype=wp.vec3d),
    coarse: wp.array(dtype=wp.vec3d),
    faces: wp.array(dtype=wp.vec3i),
    around: wp.array(dtype=wp.int32),
    starts: wp.array(dtype=wp.int32),
    onto: wp.array(dtype=wp.int32),
    corners: wp.array(dtype=wp.vec3i),
    weights: wp.array(dtype=wp.vec3d),
):
    i = wp.tid()
    p = fine[i]
    best = wp.float64(1.0e300)
    v = onto[i]
    for m in range(starts[v], starts[v + 1]):
        ring = faces[around[m]]
        for k in range(3):
            for n in range(starts[ring[k]], starts[ring[k] + 1]):
                f = faces[around[n]]
                w = _coordinates(p, coarse[f[0]], coarse[f[1]], coarse[f[2]])
                q = coarse[f[0]] * w[0] + coarse[f[1]] * w[1] + coarse[f[2]] * w[2]
                distance = wp.length_sq(p - q)
                if distance < best:
                    best = distance
                    corners[i] = f
                    weights[i] = w
