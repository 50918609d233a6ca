"""Midpoint subdivision: four triangles from each, the same surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from muslin.garments.mesh import GarmentMesh


def subdivide(mesh: GarmentMesh) -> tuple[GarmentMesh, NDArray[np.int32]]:
    """Finer mesh, and parents (V_fine, 2) int32: the sewn vertices whose mean each fine vertex is.

    x_fine = (x[parents[:, 0]] + x[parents[:, 1]]) / 2 for any vertex quantity x (V, ...); the vertices of
    `mesh` come first, in order, with both parents themselves, then one vertex an edge in the order of
    `mesh.edges`. Panel vertices and uv are halved in the same way, so the fine mesh covers exactly the same
    surface.
    """
    panel_edges, panel_faces = _split(mesh.panel_faces, len(mesh.panel_vertices))
    edges, faces = _split(mesh.faces, mesh.num_vertices)
    midpoint = np.empty(len(mesh.panel_vertices) + len(panel_edges), dtype=np.int32)
    midpoint[panel_faces] = faces
    fine = GarmentMesh(
        faces=faces,
        panel_faces=panel_faces,
        panel_vertices=_with_midpoints(mesh.panel_vertices, panel_edges),
        panel_to_vertex=midpoint,
        face_panel=np.tile(mesh.face_panel, 4),
        panel_names=mesh.panel_names,
        uv=_with_midpoints(mesh.uv, panel_edges),
        name=mesh.name,
        parameters=dict(mesh.parameters),
    )
    itself = np.repeat(np.arange(mesh.num_vertices, dtype=np.int32)[:, None], 2, axis=1)
    return fine, np.concatenate([itself, edges])


def _split(faces: NDArray[np.int32], count: int) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Edges (E, 2), sorted, and the faces (4F, 3) after a vertex `count + e` was put on each edge e."""
    half = np.concatenate([faces[:, [1, 2]], faces[:, [2, 0]], faces[:, [0, 1]]])
    edges, inverse = np.unique(np.sort(half, axis=1), axis=0, return_inverse=True)
    a, b, c = faces.T
    bc, ca, ab = (count + inverse.reshape(3, -1)).astype(np.int32)
    corners = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return edges.astype(np.int32), np.concatenate([np.stack(triangle, axis=1) for triangle in corners])


def _with_midpoints(values: NDArray[np.float64], edges: NDArray[np.int32]) -> NDArray[np.float64]:
    return np.concatenate([values, 0.5 * (values[edges[:, 0]] + values[edges[:, 1]])])
