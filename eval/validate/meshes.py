"""Flat rectangles of cloth in the triangulations that cases compare."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from muslin.garments.mesh import GarmentMesh, signed_areas
from muslin.garments.planar import triangulate_polygon

Triangulation = Literal["structured", "alternating", "irregular", "oriented"]

JITTER = 0.3
"""Largest shift of an irregular mesh's vertices, in grid spacings."""


def rectangle(
    width: float, length: float, across: int, along: int, triangulation: Triangulation, seed: int = 0
) -> GarmentMesh:
    """Rectangle [0, width] x [0, length], metres, weft along x, warp along y, `across` x `along` elements.

    structured: a grid, every cell cut along the same diagonal. alternating: along one and the other by turns.
    irregular: the grid's inner vertices shifted at random by up to `JITTER` of a spacing, Delaunay. oriented:
    nearly equilateral triangles, a hexagonal lattice turned and moved at random, with edges as long as the
    grid's are along.
    """
    if triangulation == "oriented":
        rng = np.random.default_rng(seed)
        points, faces = triangulate_polygon(
            _boundary(width, length, across, along), length / along, rng, "strip"
        )
        return flat_mesh(points, faces)
    column, row = np.meshgrid(np.arange(across + 1), np.arange(along + 1), indexing="ij")
    points = np.stack([column.ravel() * (width / across), row.ravel() * (length / along)], axis=1)
    if triangulation == "irregular":
        inner = ((column > 0) & (column < across) & (row > 0) & (row < along)).ravel()
        shift = np.random.default_rng(seed).uniform(-JITTER, JITTER, size=points.shape)
        points[inner] += (shift * [width / across, length / along])[inner]
        return flat_mesh(points, delaunay(points))
    a = (column * (along + 1) + row)[:-1, :-1].ravel()
    b, c, d = a + along + 1, a + along + 2, a + 1
    if triangulation == "alternating":
        odd = ((column + row) % 2 == 1)[:-1, :-1].ravel()
        a, b, c, d = (np.where(odd, *ends) for ends in ((d, a), (a, b), (b, c), (c, d)))
    return flat_mesh(points, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))


def mirrored(mesh: GarmentMesh) -> GarmentMesh:
    """The mesh and its mirror image in the line y = 0, on which its vertices are shared."""
    points, faces = mesh.panel_vertices, mesh.panel_faces
    above = points[:, 1] > 0.0
    image = np.arange(len(points))
    image[above] = len(points) + np.arange(above.sum())
    both = np.concatenate([points, points[above] * [1.0, -1.0]])
    return flat_mesh(both, np.concatenate([faces, image[faces][:, ::-1]]))


def centred(mesh: GarmentMesh) -> NDArray[np.float64]:
    """(V, 2) panel coordinates, metres, about the middle of the panel's extent."""
    points = mesh.panel_vertices
    return points - 0.5 * (points.min(axis=0) + points.max(axis=0))


def flat_mesh(points: NDArray[np.float64], faces: NDArray[np.integer]) -> GarmentMesh:
    """One panel without seams of points (V, 2), metres, and counter-clockwise faces (F, 3)."""
    triangles = faces.astype(np.int32)
    extent = np.ptp(points, axis=0)
    mesh = GarmentMesh(
        faces=triangles,
        panel_faces=triangles,
        panel_vertices=points,
        panel_to_vertex=np.arange(len(points), dtype=np.int32),
        face_panel=np.zeros(len(triangles), dtype=np.int32),
        panel_names=("sheet",),
        uv=(points - points.min(axis=0)) / extent,
        name="sheet",
        parameters={"width": float(extent[0]), "length": float(extent[1])},
    )
    mesh.validate()
    return mesh


def delaunay(points: NDArray[np.float64]) -> NDArray[np.int32]:
    """(F, 3) counter-clockwise faces of the Delaunay triangulation of points (V, 2)."""
    faces = Delaunay(points).simplices.astype(np.int32)
    areas = signed_areas(points, faces)
    faces = np.where(areas[:, None] < 0.0, faces[:, ::-1], faces)
    # Along a straight side three vertices may count as a triangle.
    return faces[np.abs(areas) > 1e-9 * np.abs(areas).max()]


def _boundary(width: float, length: float, across: int, along: int) -> NDArray[np.float64]:
    """(2 (across + along), 2) boundary vertices of the grid, counter-clockwise from the origin."""
    x, y = np.linspace(0.0, width, across + 1), np.linspace(0.0, length, along + 1)
    sides = [
        np.stack([x[:-1], np.zeros(across)], 1),
        np.stack([np.full(along, width), y[:-1]], 1),
        np.stack([x[:0:-1], np.full(across, length)], 1),
        np.stack([np.zeros(along), y[:0:-1]], 1),
    ]
    return np.concatenate(sides)
