"""Metrics of panel space: symmetric 2x2 tensors M, 1/m^2, that say how long an edge is for the mesh.

An edge u of panel space, metres, has the size sqrt(u^T M u), without unit: 1 is as long as it may be. The
edges of size 1 from one point end on the ellipse u^T M u = 1; its half axes are 1 / sqrt(lambda), lambda the
eigenvalues of M. A larger metric asks for shorter edges; A dominates B where A - B is positive semi-definite,
which is where the ellipse of A lies inside that of B.

All functions take stacks (N, 2, 2) float64, and are of numpy alone: no loop over elements.

Source: Narain, Samii, O'Brien 2012, Adaptive anisotropic remeshing for cloth simulation.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh

Array = NDArray[np.float64]

EQUILATERAL = np.sqrt(3.0) / 4.0  # area of a triangle whose sides are 1

SINGULAR = 1e-14
"""Smaller over larger eigenvalue at which a sum of two metrics counts as of rank one."""


def tensors(xx: Array, xy: Array, yy: Array) -> Array:
    """(N, 2, 2) symmetric tensors of their components (N,); in memory component by component, which is what
    makes arithmetic on whole stacks fast."""
    return np.moveaxis(np.array([[xx, xy], [xy, yy]]), (0, 1), (-2, -1))


def eigenvalues(metric: Array) -> Array:
    """(N, 2) eigenvalues of symmetric tensors (N, 2, 2), the larger first."""
    large, small, _, _ = _spectrum(metric)
    return np.stack([large, small], axis=-1)


def with_eigenvalues(metric: Array, large: Array, small: Array) -> Array:
    """The tensors (N, 2, 2) with these eigenvalues (N,) in place of the larger and the smaller one of
    `metric`; where those are equal, large belongs to the first axis."""
    _, _, cosine, sine = _spectrum(metric)
    return _assembled(large, small, cosine, sine)


def positive_part(metric: Array) -> Array:
    """Symmetric tensors (N, 2, 2) with their negative eigenvalues set to zero."""
    large, small, cosine, sine = _spectrum(metric)
    return _assembled(np.maximum(large, 0.0), np.maximum(small, 0.0), cosine, sine)


def square_root(metric: Array) -> Array:
    """The symmetric roots (N, 2, 2) of positive semi-definite tensors; of others, those of their positive
    parts."""
    large, small, cosine, sine = _spectrum(metric)
    roots = (np.sqrt(np.maximum(large, 0.0)), np.sqrt(np.maximum(small, 0.0)))
    return _assembled(*roots, cosine, sine)


def _spectrum(metric: Array) -> tuple[Array, Array, Array, Array]:
    """Larger and smaller eigenvalue, and cos 2 phi, sin 2 phi of the first one's direction phi.

    M = m I + r [[cos 2 phi, sin 2 phi], [sin 2 phi, -cos 2 phi]], eigenvalues m +- r.
    """
    xx, xy, yy = metric[..., 0, 0], metric[..., 0, 1], metric[..., 1, 1]
    mean, half = 0.5 * (xx + yy), 0.5 * (xx - yy)
    radius = np.sqrt(half * half + xy * xy)
    round_ = radius == 0.0
    divisor = np.where(round_, 1.0, radius)
    return mean + radius, mean - radius, np.where(round_, 1.0, half / divisor), xy / divisor


def _assembled(large: Array, small: Array, cosine: Array, sine: Array) -> Array:
    mean, radius = 0.5 * (large + small), 0.5 * (large - small)
    return tensors(mean + radius * cosine, radius * sine, mean - radius * cosine)


def quadratic_form(metric: Array, u: Array) -> Array:
    """(N,) u^T M u of tensors (N, 2, 2) and vectors (N, 2)."""
    x, y = u[..., 0], u[..., 1]
    return x * x * metric[..., 0, 0] + 2.0 * x * y * metric[..., 0, 1] + y * y * metric[..., 1, 1]


def edge_lengths(points: Array, edges: NDArray[np.integer], metric: Array) -> Array:
    """(E,) sizes sqrt(u_ij^T (M_i + M_j) / 2 u_ij) of edges (E, 2), without unit; a mesh is fine enough
    where all are <= 1.

    `points` (P, 2): panel space, metres; `metric` (P, 2, 2): 1/m^2. (Narain et al. 2012.)
    """
    i, j = edges[:, 0], edges[:, 1]
    return np.sqrt(np.maximum(quadratic_form(0.5 * (metric[i] + metric[j]), points[j] - points[i]), 0.0))


def tensor_maximum(a: Array, b: Array) -> Array:
    """The smallest metric that dominates both a and b, (N, 2, 2) positive semi-definite each.

    Two metrics have many bounds and no least one. This is the bound of smallest determinant: its ellipse is
    the largest by area inside those of a and b (John's ellipse of what they have in common), so it asks for
    the fewest triangles, which are as many as sqrt(det M) (`area_density`). It is unique, symmetric in a and
    b, turns and stretches with panel space, is b where b dominates, and has the larger of both eigenvalues on
    each axis where axes are shared.

    With S = a + b, D = a - b, and G any matrix with G G^T = S, T = G^-1 D G^-T:

        max(a, b) = G max((I + T) / 2, (I - T) / 2) G^T = (S + G |T| G^T) / 2,                            (1)

    since (I + T) / 2 and (I - T) / 2 are a and b seen from G, and share their axes. There the larger
    eigenvalues d1, d2 are the bound of smallest determinant: a bound diag(d1 + p, d2 + q) with r off the
    diagonal needs r^2 <= p (d2 - d2' + q) and r^2 <= q (d1 - d1' + p), d' the smaller ones; with either,
    (d1 + p) (d2 + q) - r^2 >= d1 d2. T has eigenvalues 1 >= t1 >= t2 >= -1 and |T| = alpha I + beta T, so

        max(a, b) = ((1 + alpha) S + beta D) / 2,
        alpha = 0, beta = +-1 where t1, t2 have one sign: one of a, b dominates,
        beta = (t1 + t2) / (t1 - t2), alpha = -2 t1 t2 / (t1 - t2) where t1 > 0 > t2.                     (2)

    Neither a nor b has to be regular: where S is of rank one, so are both, and the larger one is it. But two
    of rank one along different axes have a + b as their maximum however small the angle, for a needle of an
    ellipse gains in length what it gives up in width; `clamp` both first where needles are of no use.

    Of more than two, folded pairwise, the result is a bound, but depends a little on their order. The bound
    of smallest trace, a + the positive part of b - a = (S + |D|) / 2, is symmetric too, but not the same in a
    stretched panel space; of two equal creases that cross at an angle of sine s it makes
    sqrt((1 + s) / (2 s)) times as many triangles.
    """
    s, d = a + b, a - b
    large, small, cosine, sine = _spectrum(s)
    regular = small > SINGULAR * large
    # D on the axes of S, that is, in the frame turned by phi
    mean, half, xy = 0.5 * (d[..., 0, 0] + d[..., 1, 1]), 0.5 * (d[..., 0, 0] - d[..., 1, 1]), d[..., 0, 1]
    along = half * cosine + xy * sine
    across = xy * cosine - half * sine
    large = np.where(large > 0.0, large, 1.0)
    small = np.where(regular, small, 1.0)
    t = tensors(
        (mean + along) / large,
        np.where(regular, across / np.sqrt(large * small), 0.0),
        np.where(regular, (mean - along) / small, 0.0),
    )
    t1, t2 = (np.clip(value, -1.0, 1.0) for value in _spectrum(t)[:2])
    mixed = (t1 > 0.0) & (t2 < 0.0)
    gap = np.where(mixed, t1 - t2, 1.0)
    alpha = np.where(mixed, -2.0 * t1 * t2 / gap, 0.0)
    beta = np.where(mixed, (t1 + t2) / gap, np.where(t2 >= 0.0, 1.0, -1.0))
    return 0.5 * ((1.0 + alpha)[..., None, None] * s + beta[..., None, None] * d)


def clamp(metric: Array, size_min: float, size_max: float, aspect_min: float) -> Array:
    """Metrics (N, 2, 2) whose edges of size 1 are from `size_min` to `size_max` metres long, the shortest at
    least `aspect_min` times the longest.

    The eigenvalues are brought into [1 / size_max^2, 1 / size_min^2]; then the smaller one is raised to
    aspect_min^2 times the larger one. With aspect_min = 1 the result is isotropic.
    """
    large, small, cosine, sine = _spectrum(metric)
    lowest, highest = size_max**-2, size_min**-2
    large = np.clip(large, lowest, highest)
    small = np.maximum(np.clip(small, lowest, highest), aspect_min**2 * large)
    return _assembled(large, small, cosine, sine)


def uniform(area: ArrayLike) -> Array:
    """The metric (..., 2, 2) whose edges of size 1 are the sides of equilateral triangles of `area` m^2.

    L = sqrt(4 area / sqrt 3), M = I / L^2. Areas (P,) give a metric each. In a mesh in which every edge is at
    most of size 1, the areas lie below; InputError unless they are positive.
    """
    areas = np.asarray(area, dtype=np.float64)
    if not (np.isfinite(areas) & (areas > 0.0)).all():
        bad = areas[~(np.isfinite(areas) & (areas > 0.0))].ravel()[0]
        raise InputError(f"target area = {bad:g} m^2: must be positive; give a mean triangle area in m^2")
    return np.sqrt(3.0) / 4.0 / areas[..., None, None] * np.eye(2)


def area_density(metric: Array) -> Array:
    """(N,) sqrt(det M), 1/m^2: what area in the metric one of panel space has.

    A mesh of equilateral triangles of edges of size 1 has sum_f A_f sqrt(det M_f) 4 / sqrt(3) faces.
    """
    determinant = metric[..., 0, 0] * metric[..., 1, 1] - metric[..., 0, 1] ** 2
    return np.sqrt(np.maximum(determinant, 0.0))


def triangles_asked(mesh: GarmentMesh, metric: Array) -> Array:
    """(F,) 4 / sqrt(3) A_f sqrt(det M_f): how many equilateral triangles with edges of size 1 the metric
    (P, 2, 2) at panel vertices asks for in each triangle, M_f its mean there."""
    return mesh.face_areas * area_density(metric[mesh.panel_faces].mean(axis=1)) / EQUILATERAL


def faces_to_vertices(mesh: GarmentMesh, face_metric: Array) -> Array:
    """(P, 2, 2) averages at panel vertices of tensors (F, 2, 2) of the faces around, weighted by area.

    Those of its own panel: at a seam each panel vertex has the average of one side, for tensors of different
    panels are in frames turned against each other. `muslin.sim.remesh.seam_metric` brings the sides together.
    Bounds of `clamp` that hold on the faces hold for the averages.
    """
    index, count = mesh.panel_faces.ravel(), len(mesh.panel_vertices)
    total = np.bincount(index, np.repeat(mesh.face_areas, 3), count)
    parts = [
        np.bincount(index, np.repeat(mesh.face_areas * face_metric[:, i, j], 3), count) / total
        for i, j in ((0, 0), (0, 1), (1, 1))
    ]
    return tensors(*parts)
