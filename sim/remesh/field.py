"""The metric that a new triangulation follows, at any place in panel space."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from muslin.garments.mesh import GarmentMesh
from muslin.sim.remesh.metric import area_density, triangles_asked
from muslin.sim.remesh.panel_space import PanelSpace

FINE = 0.6  # length in the metric below which boundary edges count as finer than what is asked for
GRADATION = 0.4  # growth of the edge length with the distance from such a piece of boundary


class Field:
    """A metric given at the panel vertices of a source, made finer near boundaries that had to be.

    Where boundary edges have the length s < FINE in the metric M, edges at a distance d from them get

        h = (s + GRADATION d / h_M) h_M   in place of   h_M = det(M)^(-1/4),

    so that triangles grow gradually; the whole panel is made coarser by as much as keeps the number of
    triangles.
    """

    def __init__(
        self,
        mesh: GarmentMesh,
        metric: NDArray[np.float64],
        space: PanelSpace,
        rim: NDArray[np.float64],
        spacing: NDArray[np.float64],
    ) -> None:
        """metric: (P, 2, 2), 1/m^2; rim: (R, 3) boundary vertices as `space` lifts them; spacing: (R,)."""
        self._space, self._faces = space, mesh.panel_faces
        panels = len(mesh.panel_names)
        _, first = np.unique(mesh.panel_vertex_panel, return_index=True)
        constant = metric[first][mesh.panel_vertex_panel]
        self._constant = metric[first] if np.allclose(metric, constant, rtol=1e-12, atol=0.0) else None
        fine = spacing < FINE
        self._tree = cKDTree(rim[fine]) if fine.any() else None
        self._spacing = spacing[fine]
        self._metric = metric
        self._scale = np.ones(panels)
        if self._tree is not None:
            graded = self._graded(metric, space.lift(mesh.panel_vertices, mesh.panel_vertex_panel))
            plain, finer = (
                np.bincount(mesh.face_panel, triangles_asked(mesh, field), panels)
                for field in (metric, graded)
            )
            self._scale = plain / finer

    def at(self, points: NDArray[np.float64], panel: NDArray[np.int32]) -> NDArray[np.float64]:
        """(N, 2, 2) the metric at points (N, 2), metres, of panels (N,)."""
        if self._constant is not None:
            metric = self._constant[panel]
        else:
            face, weights = self._space.locate(points, panel)
            metric = np.einsum("nk,nkij->nij", weights, self._metric[self._faces[face]])
        if self._tree is None:
            return metric
        return self._graded(metric, self._space.lift(points, panel)) * self._scale[panel][:, None, None]

    def _graded(self, metric: NDArray[np.float64], lifted: NDArray[np.float64]) -> NDArray[np.float64]:
        assert self._tree is not None
        distance, nearest = self._tree.query(lifted)
        per_metre = np.sqrt(area_density(metric))
        size = self._spacing[nearest] + GRADATION * distance * per_metre
        return metric / np.minimum(size, 1.0)[:, None, None] ** 2
