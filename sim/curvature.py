"""Curvature of a triangle as a linear function of hinge angles, for any triangulation.

The quadratic on a triangle of area A that is zero at the corners and rises with slopes a_i across the middle
of its edges, of length l_i and outward normal n_i, has the second derivative

    K = (1 / A) sum_i l_i a_i n_i n_i^T.                                                              (1)

The angle theta of a hinge is the sum of the slopes on its two sides. In a sheet of curvature K, with the
opposite corner of a triangle at s t - h n in the frame (n, t) of the edge and its middle,

    a = alpha . K = h K_nn / 2 - s K_nt - (l^2 / 4 - s^2) K_tt / (2 h),
    theta = (alpha_1 + alpha_2) . K.                                                                  (2)

So a_1 = theta / 2 + (alpha_1 - alpha_2) . K_e / 2 and a_2 = theta - a_1, where K_e is the least-squares fit
of (2) to the hinges of both triangles. On a free edge a = alpha . K_e. Where those hinges do not determine
K_e, their neighbours join; what remains undetermined is zero.

This has two properties. K is exact for every quadratic, on any mesh. And since a_1 + a_2 = theta, a
constant moment M does the work sum l theta M_nn, as on the folded sheet itself: the patch test of Morley's
triangle. The quadratic through a triangle and its three neighbours has only the first, and sheets of it are
too soft.

Sources: Morley 1968, and Grinspun, Gingold, Reisman, Zorin 2006 (slopes at edges, (1)); Onate, Zarate 2000
(curvature from the neighbours, without rotations).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, eye_array, vstack

from muslin.sim.curvature_fit import fit

Array = NDArray[np.float64]
Index = NDArray[np.int64]


def curvature_operator(
    corners: Array, hinge_of_corner: Index, hinge_faces: Index, hinge_corner: Index
) -> csr_array:
    """(3 F, H) matrix from hinge angles to (K11, K22, K12) of every triangle, 1/m.

    `corners` (F, 3, 2): corners in their panel's (warp, weft) coordinates, metres, all clockwise or all not.
    `hinge_of_corner` (F, 3): hinge on the edge opposite a corner, or -1 on a free edge.
    `hinge_faces`, `hinge_corner` (H, 2): both triangles of a hinge, and the corner opposite it in each.
    """
    slopes = _Slopes.of(corners)
    num_faces, num_hinges = len(corners), len(hinge_faces)
    free_face, free_corner = np.nonzero(hinge_of_corner < 0)
    sides = [(hinge_faces[:, k], hinge_corner[:, k]) for k in range(2)]

    angle = slopes.alpha[sides[0]] + slopes.alpha[sides[1]]
    wanted = np.concatenate(
        [
            _rows(0.5 * (slopes.alpha[sides[0]] - slopes.alpha[sides[1]]), slopes.frame[sides[0]]),
            _rows(slopes.alpha[free_face, free_corner], slopes.frame[free_face, free_corner]),
        ]
    )
    on_hinge = hinge_of_corner >= 0
    measured = np.zeros((num_faces, 3, 3))
    measured[on_hinge] = _rows(angle[hinge_of_corner[on_hinge]], slopes.frame[on_hinge])

    neighbour = np.full((num_faces, 3), -1)
    turn = np.zeros((num_faces, 3))
    for (face, corner), (other, other_corner) in (sides, sides[::-1]):
        neighbour[face, corner] = other
        # The edge runs the other way in the neighbour: its panel is laid beside this one, turned by this.
        turn[face, corner] = slopes.direction[face, corner] + np.pi - slopes.direction[other, other_corner]

    start = np.concatenate([sides[0][0], free_face])
    beside = np.concatenate([sides[1][0], np.full(len(free_face), -1)])
    beside_turn = np.concatenate([turn[sides[0]], np.zeros(len(free_face))])
    edges = np.stack([start, beside], axis=1)
    fitted = fit(measured, hinge_of_corner, neighbour, turn, wanted, edges, beside_turn, num_hinges)

    half = 0.5 * eye_array(num_hinges, format="csr")
    slope = vstack([half + fitted[:num_hinges], half - fitted[:num_hinges], fitted[num_hinges:]])
    slope_of_corner = np.empty((num_faces, 3), np.int64)
    slope_of_corner[sides[0]] = np.arange(num_hinges)
    slope_of_corner[sides[1]] = num_hinges + np.arange(num_hinges)
    slope_of_corner[free_face, free_corner] = 2 * num_hinges + np.arange(len(free_face))

    n = slopes.frame[..., 0, :]
    tensor = _products(n, n) * [1.0, 1.0, 0.5] * (slopes.length / slopes.area[:, None])[..., None]
    rows = np.broadcast_to(3 * np.arange(num_faces)[:, None, None] + np.arange(3), (num_faces, 3, 3))
    columns = np.broadcast_to(slope_of_corner[..., None], (num_faces, 3, 3))
    morley = csr_array(
        (tensor.ravel(), (rows.ravel(), columns.ravel())), shape=(3 * num_faces, slope.shape[0])
    )
    return csr_array(morley @ slope)


@dataclass(frozen=True)
class _Slopes:
    """Per face and corner, of the edge opposite it: `length` (F, 3) m, `direction` (F, 3) rad,
    `frame` (F, 3, 2, 2) with rows n and t, and `alpha` (F, 3, 3) of (2), over (K_nn, K_nt, K_tt), m."""

    length: Array
    direction: Array
    frame: Array
    alpha: Array
    area: Array

    @staticmethod
    def of(corners: Array) -> _Slopes:
        begin, end = np.roll(corners, -1, axis=1), np.roll(corners, -2, axis=1)
        length = np.linalg.norm(end - begin, axis=2)
        t = (end - begin) / length[..., None]
        opposite = corners - 0.5 * (begin + end)
        n = np.stack([t[..., 1], -t[..., 0]], axis=-1)
        n *= -np.sign((opposite * n).sum(axis=2))[..., None]
        s, h = (opposite * t).sum(axis=2), -(opposite * n).sum(axis=2)
        alpha = np.stack([0.5 * h, -s, -(0.25 * length**2 - s**2) / (2.0 * h)], axis=-1)
        direction = np.arctan2(t[..., 1], t[..., 0])
        return _Slopes(length, direction, np.stack([n, t], axis=-2), alpha, 0.5 * length[:, 0] * h[:, 0])


def _products(u: Array, v: Array) -> Array:
    """u^T K v as rows over (K11, K22, K12)."""
    return np.stack(
        [u[..., 0] * v[..., 0], u[..., 1] * v[..., 1], u[..., 0] * v[..., 1] + u[..., 1] * v[..., 0]], axis=-1
    )


def _rows(alpha: Array, frame: Array) -> Array:
    """alpha over (K_nn, K_nt, K_tt) in frames with rows n, t, as rows over (K11, K22, K12)."""
    n, t = frame[..., 0, :], frame[..., 1, :]
    basis = np.stack([_products(n, n), _products(n, t), _products(t, t)], axis=-2)
    return (alpha[..., None, :] @ basis)[..., 0, :]
