"""Colliders of the cases: vertices (N, 3), metres, and faces (M, 3) counter-clockwise from outside."""

from __future__ import annotations

import numpy as np
import trimesh
from numpy.typing import NDArray

Surface = tuple[NDArray[np.float64], NDArray[np.int32]]


def slope(angle: float, side: float) -> Surface:
    """A square of two triangles through the origin, falling towards +x by `angle` radians."""
    h = 0.5 * side
    corners = np.array([[-h, 0.0, -h], [-h, 0.0, h], [h, 0.0, h], [h, 0.0, -h]])
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return corners @ turn.T, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)


def sphere(radius: float, subdivisions: int) -> Surface:
    """An icosphere around the origin."""
    ball = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
    return np.asarray(ball.vertices, dtype=np.float64), np.asarray(ball.faces, dtype=np.int32)
