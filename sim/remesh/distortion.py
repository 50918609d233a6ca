"""Distortion of triangles in the metric that they follow, and which of it the pattern itself makes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from muslin.garments.boundary_angles import boundary_angles, corners_at
from muslin.garments.mesh import GarmentMesh
from muslin.sim.remesh.metric import EQUILATERAL, area_density, quadratic_form

Array = NDArray[np.float64]

MAX_DISTORTION = 2.5
"""Allowed where nothing else is said."""


def distortion(mesh: GarmentMesh, metric: Array) -> Array:
    """(F,) normalised aspect of the panel triangles in a metric (P, 2, 2) at panel vertices; 1: equilateral,

        (sqrt(3) / 2) l / h = (sqrt(3) / 4) l^2 / (A sqrt(det M)),

    l the longest edge and h the smallest altitude, as long as the mean metric M of the corners says; A the
    area in panel space. In a uniform metric that is the distortion of the triangle itself.
    """
    edges = _edges(mesh)
    of_face = metric[mesh.panel_faces].mean(axis=1)
    longest = np.max([quadratic_form(of_face, edges[:, k]) for k in range(3)], axis=0)
    return EQUILATERAL * longest / (mesh.face_areas * area_density(of_face))


def least_quality(largest: float) -> float:
    """The quality of `relax.quality` above which no triangle has a distortion above `largest`, D:

        q >= 2 D / (D^2 + 1).

    With longest edge 1 and altitude h = sqrt(3) / (2 D) on it, q = 2 sqrt(3) h / (l_1^2 + l_2^2 + l_3^2); the
    sum of squares is least, 3/2 + 2 h^2, where the other two sides are equal.
    """
    return 2.0 * largest / (largest * largest + 1.0)


def forced(mesh: GarmentMesh, source: GarmentMesh, metric: Array, largest: float) -> NDArray[np.bool_]:
    """(F,) whether a triangle of `mesh` lies in a corner that the pattern makes too sharp for `largest`, D.

    A triangle with an angle beta <= 60 degrees has a distortion of at least sqrt(3) / (2 sin beta), that of
    the isosceles one. So at corners of `source` with sin beta < sqrt(3) / (2 D), angles in the metric
    (P, 2, 2) at its panel vertices, triangles are left out whose middle lies where the tip is narrower than
    an edge: within 1 / (2 sin(beta / 2)) of the corner, in the metric there. Nothing else is.
    """
    edges = _edges(source)
    of_face = metric[source.panel_faces].mean(axis=1)
    angles = np.empty(source.panel_faces.shape)
    across = 2.0 * source.face_areas * area_density(of_face)
    for k in range(3):
        # Edges k and k - 1 leave corner k, the latter backwards.
        u, v = edges[:, k], -edges[:, k - 1]
        angles[:, k] = np.arctan2(across, np.einsum("fi,fij,fj->f", u, of_face, v))
    sharp = np.arcsin(min(0.5 * np.sqrt(3.0) / largest, 1.0))
    beta = boundary_angles(source, angles)
    middle = mesh.panel_vertices[mesh.panel_faces].mean(axis=1)
    found = corners_at(mesh, source, beta < sharp).any(axis=1)
    for corner in np.flatnonzero(beta < sharp):
        way = middle - source.panel_vertices[corner]
        square = np.einsum("fi,ij,fj->f", way, metric[corner], way)
        near = square < (0.5 / np.sin(0.5 * beta[corner])) ** 2
        found |= near & (mesh.face_panel == source.panel_vertex_panel[corner])
    return np.asarray(found)


def _edges(mesh: GarmentMesh) -> Array:
    """(F, 3, 2) panel-space vectors from each corner to the next."""
    corners = mesh.panel_vertices[mesh.panel_faces]
    return np.roll(corners, -1, axis=1) - corners
