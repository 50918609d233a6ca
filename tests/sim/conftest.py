"""Small flat meshes, made by hand or of the sheet."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import warp as wp
from numpy.typing import ArrayLike

from muslin.garments import catalogue
from muslin.garments.mesh import GarmentMesh
from muslin.garments.triangulate import triangulate

wp.config.log_level = wp.LOG_WARNING

FlatMesh = Callable[[ArrayLike, ArrayLike], GarmentMesh]


def make_flat_mesh(panel_vertices: ArrayLike, faces: ArrayLike) -> GarmentMesh:
    """One panel without seams: vertices (V, 2), metres, warp along +y; faces (F, 3)."""
    panel = np.asarray(panel_vertices, dtype=np.float64)
    triangles = np.asarray(faces, dtype=np.int32)
    return GarmentMesh(
        faces=triangles,
        panel_faces=triangles,
        panel_vertices=panel,
        panel_to_vertex=np.arange(len(panel), dtype=np.int32),
        face_panel=np.zeros(len(triangles), dtype=np.int32),
        panel_names=("flat",),
        uv=np.zeros_like(panel),
        name="flat",
        parameters={},
    )


@pytest.fixture
def flat_mesh() -> FlatMesh:
    return make_flat_mesh


@pytest.fixture
def grid_mesh() -> Callable[[int, int, float], GarmentMesh]:
    """(nx, ny, side) -> nx x ny squares of `side` metres, diagonals alternating, top edge at y = 0.

    Vertex i (ny + 1) + j is in column i, from the left, and row j, from below.
    """

    def make(nx: int, ny: int, side: float) -> GarmentMesh:
        column, row = np.meshgrid(np.arange(nx + 1), np.arange(ny + 1), indexing="ij")
        panel = side * np.stack([column.ravel() - 0.5 * nx, row.ravel() - float(ny)], axis=1)
        faces = []
        for i in range(nx):
            for j in range(ny):
                a, b = i * (ny + 1) + j, (i + 1) * (ny + 1) + j
                c, d = b + 1, a + 1
                faces += [(a, b, c), (a, c, d)] if (i + j) % 2 == 0 else [(a, b, d), (b, c, d)]
        return make_flat_mesh(panel, faces)

    return make


@pytest.fixture
def sheet_mesh() -> GarmentMesh:
    """The sheet, 0.3 m x 0.4 m, irregular triangles of 8 cm."""
    return triangulate(catalogue.get("sheet").pattern(width=0.3, length=0.4), 0.08)
