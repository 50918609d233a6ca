"""Angles of panels at their boundary: how sharp the pattern itself makes corners of triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from muslin.garments.mesh import GarmentMesh

ON_CORNER = 1e-6  # metres


def boundary_angles(mesh: GarmentMesh, angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Interior angle of the panel's boundary at each panel vertex, radians: beta_v = sum of the angles of the
    triangles at v; (P,), infinite for vertices inside a panel, which no boundary confines.

    angles: (F, 3), radians, of the triangles' corners, in panel space or in any metric of it.
    """
    total = np.bincount(mesh.panel_faces.ravel(), angles.ravel(), len(mesh.panel_vertices))
    on_boundary = np.zeros(len(total), dtype=bool)
    on_boundary[mesh.panel_boundary_edges] = True
    return np.where(on_boundary, total, np.inf)


def corners_at(mesh: GarmentMesh, source: GarmentMesh, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(F, 3) which corners of the triangles of `mesh` lie at `chosen` panel vertices (P,) of `source`: within
    ON_CORNER, in the panel of the same index."""
    there = np.zeros(len(mesh.panel_vertices), dtype=bool)
    for vertex in np.flatnonzero(chosen):
        near = np.linalg.norm(mesh.panel_vertices - source.panel_vertices[vertex], axis=1) <= ON_CORNER
        there |= near & (mesh.panel_vertex_panel == source.panel_vertex_panel[vertex])
    return there[mesh.panel_faces]
