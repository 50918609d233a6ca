"""Point location in all panels of a garment at once."""

from __future__ import annotations

import igl
import numpy as np
from numpy.typing import NDArray

from muslin.garments.locate import barycentric
from muslin.garments.mesh import GarmentMesh


class PanelSpace:
    """The panels of a garment above one another, far enough apart that what is nearest is in one's own."""

    def __init__(self, mesh: GarmentMesh) -> None:
        self._faces = mesh.panel_faces.astype(np.int64)
        self._points = mesh.panel_vertices
        self._height = 2.0 * float(np.linalg.norm(np.ptp(mesh.panel_vertices, axis=0)))
        self._lifted = self.lift(mesh.panel_vertices, mesh.panel_vertex_panel)

    def lift(self, points: NDArray[np.float64], panel: NDArray[np.int32]) -> NDArray[np.float64]:
        """(N, 3): points (N, 2) of panels (N,) at the height of their panel."""
        return np.column_stack([points, panel * self._height])

    def locate(
        self, points: NDArray[np.float64], panel: NDArray[np.int32]
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Triangle (N,) and barycentric coordinates (N, 3) of points (N, 2), metres, of panels (N,).

        A point outside its panel gets the triangle nearest to it, and coordinates of the nearest point there.
        """
        if len(points) == 0:
            return np.zeros(0, dtype=np.int64), np.zeros((0, 3))
        lifted = self.lift(points, panel)
        _, face, nearest = igl.point_mesh_squared_distance(lifted, self._lifted, self._faces)
        return face.astype(np.int64), barycentric(self._points[self._faces[face]], nearest[:, :2])
