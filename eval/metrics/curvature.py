"""Signed mean curvature of a surface, and the distance between the distributions of two surfaces."""

from __future__ import annotations

from dataclasses import dataclass

import igl
import numpy as np
from scipy.stats import wasserstein_distance

from muslin.eval.metrics.checks import check_faces, checked_points
from muslin.garments.errors import InputError
from muslin.garments.half_edges import half_edges, on_boundary


@dataclass(frozen=True, eq=False)
class Curvatures:
    """Signed mean curvature `values` (N,), 1/m, and `areas` (N,), m^2, of the inner vertices of a mesh."""

    values: np.ndarray
    areas: np.ndarray

    @property
    def rms(self) -> float:
        """sqrt( sum A H^2 / sum A ), 1/m: how wrinkled the surface is."""
        return float(np.sqrt(np.average(self.values**2, weights=self.areas)))


def mean_curvature(vertices: np.ndarray, faces: np.ndarray) -> Curvatures:
    """Signed mean curvature at the inner vertices, from the cotangent Laplacian.

        H_i = (K x)_i . n_i / (2 A_i),    (K x)_i = 1/2 sum_j (cot a_ij + cot b_ij) (x_i - x_j)

    A_i the mixed Voronoi area of the vertex, n_i its normal, the mean of the normals of its faces by angle.
    H = (k1 + k2) / 2 is positive where the surface is convex seen from the side of the normals: 1 / r on a
    sphere whose normals point outward, 1 / (2 r) on such a cylinder.

    Vertices on a boundary are left out, and their areas with them: there (K x)_i is the pull of the open
    edge, which is no curvature and grows without bound as the mesh is refined.

    Sums over regions converge as a mesh is refined, values at single vertices need not (Xu 2004): on a
    cylinder they are exact where edges run along it, and stray by 2 to 5% on average on irregular triangles.

    vertices (V, 3), metres; faces (F, 3), an oriented manifold. Raises InputError for meshes that are empty,
    not finite, have triangles without area, or no inner vertex.

    Source: Meyer, Desbrun, Schroeder, Barr 2003 (cotangents, mixed areas; (K x) / A = 2 H n).
    """
    x = checked_points(vertices, "mean curvature")
    check_faces(faces, len(x), "mean curvature")
    f = np.ascontiguousarray(faces, dtype=np.int64)
    pull = -(igl.cotmatrix(x, f) @ x)
    area = igl.massmatrix(x, f, igl.MASSMATRIX_TYPE_VORONOI).diagonal()
    inner = np.bincount(f.ravel(), minlength=len(x)) > 0
    triangles = faces.astype(np.int32)
    inner[half_edges(triangles)[on_boundary(triangles)].ravel()] = False
    if not inner.any():
        raise InputError("mean curvature: every vertex lies on a boundary; give a finer mesh")
    normal = igl.per_vertex_normals(x, f, igl.PER_VERTEX_NORMALS_WEIGHTING_TYPE_ANGLE)
    values = (pull[inner] * normal[inner]).sum(axis=1) / (2.0 * np.maximum(area[inner], 1e-300))
    if not (np.isfinite(values).all() and (area[inner] > 0.0).all()):
        raise InputError("mean curvature: a triangle has no area, so no cotangents; remove such triangles")
    return Curvatures(values, area[inner])


def curvature_distance(prediction: Curvatures, truth: Curvatures) -> float:
    """1-Wasserstein distance of the area-weighted distributions of mean curvature, 1/m.

        W = integral over h of | P(H <= h) - P'(H <= h) | dh,   P(H <= h) the share of area with H <= h

    The mean distance that curvature has to be shifted by to turn one histogram into the other, without bins
    to choose. No correspondence is needed, so it sees how wrinkled a surface is, not where; and a finer mesh
    has room for more curvature, so meshes of different resolution differ by that too.

    Source: Rubner, Tomasi, Guibas 2000 (earth mover's distance of distributions); scipy's
    `wasserstein_distance`.
    """
    return float(wasserstein_distance(prediction.values, truth.values, prediction.areas, truth.areas))
