"""Cutting: a pattern becomes panel triangulations whose seam vertices are paired."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from muslin.garments.mesh import GarmentMesh
from muslin.garments.pattern import Pattern
from muslin.garments.planar import triangulate_polygon
from muslin.garments.sampling import BoundarySampling


@dataclass(frozen=True, eq=False)
class Cut:
    """Triangulated panels of a pattern, not yet placed in the uv layout.

    panel_faces: (F, 3) int32, counter-clockwise, over panel vertices
    panel_vertices: (P, 2) float64, metres; panel after panel, in each the boundary first, counter-clockwise
        from the start of the panel's first edge, then the interior
    panel_to_vertex: (P,) int32, sewn vertex of each panel vertex
    face_panel: (F,) int32
    panel_starts: (panels + 1,) int64, first vertex of each panel, then P
    sampling: number of segments of each edge
    """

    panel_faces: NDArray[np.int32]
    panel_vertices: NDArray[np.float64]
    panel_to_vertex: NDArray[np.int32]
    face_panel: NDArray[np.int32]
    panel_starts: NDArray[np.int64]
    sampling: BoundarySampling

    @cached_property
    def num_vertices(self) -> int:
        """Number of sewn vertices."""
        return int(self.panel_to_vertex.max()) + 1

    def faces_of(self, panel: int) -> NDArray[np.int32]:
        """(F_k, 3) faces of one panel over its own vertices."""
        faces = self.panel_faces[self.face_panel == panel] - self.panel_starts[panel]
        return faces.astype(np.int32)

    def vertices_of(self, panel: int) -> NDArray[np.float64]:
        """(P_k, 2) vertices of one panel, metres."""
        return self.panel_vertices[self.panel_starts[panel] : self.panel_starts[panel + 1]]

    def mesh(
        self, pattern: Pattern, panel_vertices: NDArray[np.float64], uv: NDArray[np.float64]
    ) -> GarmentMesh:
        """The sewn, validated mesh of `pattern` with this connectivity and the given coordinates (P, 2)."""
        mesh = GarmentMesh(
            faces=self.panel_to_vertex[self.panel_faces],
            panel_faces=self.panel_faces,
            panel_vertices=panel_vertices,
            panel_to_vertex=self.panel_to_vertex,
            face_panel=self.face_panel,
            panel_names=tuple(panel.name for panel in pattern.panels),
            uv=uv,
            name=pattern.name,
            parameters=dict(pattern.parameters),
        )
        mesh.validate()
        return mesh


def cut_pattern(pattern: Pattern, edge_length: float, seed: int) -> Cut:
    """Triangulate every panel of a valid pattern with edges of about `edge_length` metres.

    Both sides of a seam are sampled alike; panel vertices that are sewn together, corners where several
    panels meet included, share one sewn vertex. Raises InputError if a panel is too narrow for the edge
    length.
    """
    sampling = BoundarySampling.of(pattern, edge_length)
    sewn = sampling.sewn(pattern)
    rng = np.random.default_rng(seed)
    points, faces, face_panel, vertex = [], [], [], []
    starts, next_boundary, next_interior = [0], 0, int(sewn.max()) + 1
    for index, panel in enumerate(pattern.panels):
        boundary = sampling.points(pattern, panel.name)
        panel_points, panel_faces = triangulate_polygon(boundary, edge_length, rng, panel.name)
        interior = len(panel_points) - len(boundary)
        points.append(panel_points)
        faces.append(panel_faces + starts[-1])
        face_panel.append(np.full(len(panel_faces), index))
        vertex.append(sewn[next_boundary : next_boundary + len(boundary)])
        vertex.append(np.arange(next_interior, next_interior + interior, dtype=np.int32))
        starts.append(starts[-1] + len(panel_points))
        next_boundary += len(boundary)
        next_interior += interior
    return Cut(
        panel_faces=np.concatenate(faces).astype(np.int32),
        panel_vertices=np.concatenate(points),
        panel_to_vertex=np.concatenate(vertex).astype(np.int32),
        face_panel=np.concatenate(face_panel).astype(np.int32),
        panel_starts=np.array(starts, dtype=np.int64),
        sampling=sampling,
    )
