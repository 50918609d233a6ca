"""Nearest points of a triangle surface, exact: to the triangles and not only to their corners."""

from __future__ import annotations

from functools import cached_property

import igl
import numpy as np

from muslin.eval.metrics.vertex import triangle_areas
from muslin.garments.errors import InputError
from muslin.garments.half_edges import half_edges, opposite


class Surface:
    """A triangle mesh that is asked for nearest points, with a tree over its faces.

    vertices (V, 3) float64, metres; faces (F, 3) int64. Raises InputError, beginning with `name`, unless
    there are faces, their indices are in range and all coordinates finite. Vertices without a face, faces
    without area, several vertices in one place and edges of more than two faces are allowed.
    """

    def __init__(self, vertices: np.ndarray, faces: np.ndarray, name: str = "surface") -> None:
        self.vertices = np.ascontiguousarray(vertices, dtype=np.float64)
        self.faces = np.ascontiguousarray(faces, dtype=np.int64)
        self.name = name
        self._check()
        self.tree = igl.AABB()
        self.tree.init(self.vertices, self.faces)

    def _check(self) -> None:
        for what, array in (("vertices", self.vertices), ("faces", self.faces)):
            if array.ndim != 2 or array.shape[1] != 3 or len(array) == 0:
                raise InputError(f"{self.name}: {what} of shape {array.shape}; give (N >= 1, 3)")
        if self.faces.min() < 0 or self.faces.max() >= len(self.vertices):
            raise InputError(
                f"{self.name}: faces name vertices {self.faces.min()} to {self.faces.max()}; "
                f"allowed: 0 to {len(self.vertices) - 1}"
            )
        bad = np.flatnonzero(~np.isfinite(self.vertices).all(axis=1))
        if len(bad):
            raise InputError(
                f"{self.name}: NaN or infinity at vertex {bad[0]} ({len(bad)} in all); every coordinate must "
                "be finite"
            )

    @cached_property
    def corners(self) -> np.ndarray:
        """(F, 3 corners, 3), metres."""
        return self.vertices[self.faces]

    @cached_property
    def areas(self) -> np.ndarray:
        """(F,) square metres."""
        return triangle_areas(self.vertices, self.faces)

    @cached_property
    def neighbours(self) -> np.ndarray:
        """(F, 3) the face across the edge from corner i to corner i + 1 that runs it the other way; -1 for
        none. Vertices in one place count as one."""
        _, welded = np.unique(self.vertices + 0.0, axis=0, return_inverse=True)
        half = half_edges(welded.reshape(-1)[self.faces].astype(np.int32))
        across = opposite(half[:, 0], half[:, 1], len(self.vertices))
        return np.where(across >= 0, across % len(self.faces), -1).reshape(3, -1).T

    def closest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Distances (N,), faces (N,) and places (N, 3) of the nearest surface points of points (N, 3)."""
        if len(points) == 0:
            return np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros((0, 3))
        squared, nearest, feet = self.tree.squared_distance(
            self.vertices, self.faces, np.ascontiguousarray(points, dtype=np.float64)
        )
        return np.sqrt(np.maximum(squared, 0.0)), nearest, feet


def point_triangle_distance(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Exact distance of points (..., 3) to triangles (..., 3 corners, 3); (...), the unit of the input.

    The smallest distance to the three edges, or the distance to the plane where the foot of the
    perpendicular is inside the triangle.
    """
    a, b, c = triangles[..., 0, :], triangles[..., 1, :], triangles[..., 2, :]
    normal = np.cross(b - a, c - a)
    square = np.einsum("...i,...i", normal, normal)
    edges = np.stack([_segment_squared(points, s, e) for s, e in ((a, b), (b, c), (c, a))])
    squared = edges.min(axis=0)
    sides = [np.einsum("...i,...i", np.cross(e - s, points - s), normal) for s, e in ((a, b), (b, c), (c, a))]
    inside = (sides[0] >= 0) & (sides[1] >= 0) & (sides[2] >= 0) & (square > 0)
    height = np.einsum("...i,...i", points - a, normal) ** 2 / np.where(square > 0, square, 1.0)
    return np.sqrt(np.where(inside, np.minimum(height, squared), squared))


def _segment_squared(points: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    along = end - start
    length = np.einsum("...i,...i", along, along)
    t = np.einsum("...i,...i", points - start, along) / np.where(length > 0, length, 1.0)
    offset = points - start - np.clip(t, 0.0, 1.0)[..., None] * along
    return np.einsum("...i,...i", offset, offset)
