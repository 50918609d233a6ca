"""Panels with curved boundaries, holes and seams of their own."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from muslin.garments.mesh import GarmentMesh


def one_panel(
    points: NDArray[np.float64], faces: NDArray[np.int32], sewn: NDArray[np.int32] | None = None
) -> GarmentMesh:
    """A garment of one panel; points (P, 2), faces (F, 3), sewn (P,) vertex of each, by default its own."""
    vertex = np.arange(len(points), dtype=np.int32) if sewn is None else sewn
    return GarmentMesh(
        faces=vertex[faces],
        panel_faces=faces,
        panel_vertices=points,
        panel_to_vertex=vertex,
        face_panel=np.zeros(len(faces), dtype=np.int32),
        panel_names=("panel",),
        uv=(points - points.min(axis=0)) / np.ptp(points, axis=0).max(),
        name="one",
        parameters={},
    )


def annulus(inner: float, outer: float, around: int, rings: int) -> GarmentMesh:
    """A ring between two circles, metres, of `around` vertices each, and `rings` rows of triangles."""
    angle = 2.0 * np.pi * np.arange(around) / around
    radius = np.linspace(inner, outer, rings + 1)
    points = radius[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    row, column = (index.ravel() for index in np.meshgrid(np.arange(rings), np.arange(around)))
    a, b = row * around + column, row * around + (column + 1) % around
    faces = np.concatenate([np.stack([a, a + around, b], 1), np.stack([b, a + around, b + around], 1)])
    return one_panel(points.reshape(-1, 2), faces.astype(np.int32))


def disk(radius: float, around: int, rings: int) -> GarmentMesh:
    """A disk, whose only boundary is one closed curve without corners."""
    outside = annulus(radius / rings, radius, around, rings - 1)
    centre = len(outside.panel_vertices)
    fan = np.stack(
        [np.arange(around), (np.arange(around) + 1) % around, np.full(around, centre)], axis=1
    ).astype(np.int32)
    return one_panel(
        np.vstack([outside.panel_vertices, [[0.0, 0.0]]]), np.concatenate([outside.panel_faces, fan])
    )


def tube(circumference: float, height: float, around: int, rows: int) -> GarmentMesh:
    """A rectangle sewn to itself along one seam: its hems are closed curves through the seam's ends."""
    x, y = np.linspace(0.0, circumference, around + 1), np.linspace(0.0, height, rows + 1)
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    column, row = (index.ravel() for index in np.meshgrid(np.arange(around), np.arange(rows)))
    a = column * (rows + 1) + row
    b, c, d = a + rows + 1, a + rows + 2, a + 1
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)
    sewn = np.arange(len(points))
    sewn[around * (rows + 1) :] = np.arange(rows + 1)
    return one_panel(points, faces, sewn.astype(np.int32))


def dart(radius: float, opening: float, around: int, rings: int) -> GarmentMesh:
    """A disk without a wedge of `opening` radians, whose two straight edges are sewn: a dart, its tip in the
    middle, one panel vertex that the seam ends at."""
    angle = np.linspace(0.0, 2.0 * np.pi - opening, around + 1)
    ring = radius * np.arange(1, rings + 1) / rings
    points = ring[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    row, column = (index.ravel() for index in np.meshgrid(np.arange(rings - 1), np.arange(around)))
    a = 1 + row * (around + 1) + column
    b, c, d = a + 1, a + around + 1, a + around + 2
    fan = np.stack([np.zeros(around, int), np.arange(1, around + 1), np.arange(2, around + 2)], 1)
    faces = np.concatenate([fan, np.stack([a, c, d], 1), np.stack([a, d, b], 1)]).astype(np.int32)
    sewn = np.zeros(1 + rings * (around + 1), dtype=np.int64)
    place = np.minimum(np.arange(around + 1) % around, around)
    sewn[1:] = (1 + np.arange(rings)[:, None] * around + place).ravel()
    return one_panel(np.vstack([[[0.0, 0.0]], points.reshape(-1, 2)]), faces, sewn.astype(np.int32))
